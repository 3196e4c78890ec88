# covary_precompile(<target>)
#
# Headers that most files include are compiled once and read by all: those of the standard library and {fmt} for the
# modules, GoogleTest's beside them for the tests. -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON, which the presets for
# development set, compiles every file by itself and so finds includes that are missing.
set(covary_precompiled_headers
  <algorithm> <array> <atomic> <bit> <charconv> <cmath> <cstdint> <cstring> <filesystem> <functional> <limits> <map>
  <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view> <type_traits> <utility> <vector>
  <fmt/format.h>)

if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  # GCC 12 forgets that precompiled headers are the system's, and warns of its own strings (GCC bug 105651).
  target_compile_options(covary_options INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread>)
endif()

# Tests are compiled with little optimisation, in two thirds of the time; what they test is not.
function(covary_test_options program)
  target_compile_options(${program} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# Position-independent code of libraries differs from that of programs, so each kind has its own.
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/library.cpp CONTENT "\n")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/program.cpp CONTENT "int main() {}\n")
add_library(covary_precompiled STATIC ${PROJECT_BINARY_DIR}/precompiled/library.cpp)
target_link_libraries(covary_precompiled PRIVATE covary_options fmt::fmt)
target_precompile_headers(covary_precompiled PRIVATE ${covary_precompiled_headers})
if(COVARY_TESTS)
  add_executable(covary_precompiled_tests ${PROJECT_BINARY_DIR}/precompiled/program.cpp)
  covary_test_options(covary_precompiled_tests)
  target_link_libraries(covary_precompiled_tests PRIVATE covary_options fmt::fmt GTest::gtest)
  target_precompile_headers(covary_precompiled_tests PRIVATE ${covary_precompiled_headers} <gtest/gtest.h>)
endif()

function(covary_precompile target)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL EXECUTABLE)
    target_precompile_headers(${target} REUSE_FROM covary_precompiled_tests)
  else()
    target_precompile_headers(${target} REUSE_FROM covary_precompiled)
  endif()
endfunction()
