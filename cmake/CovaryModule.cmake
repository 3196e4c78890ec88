# covary_module(<name> [TOGETHER] SOURCES a.cpp ... HEADERS a.h ... DEPENDS module-or-target ...
#               TESTS a_test.cpp ... TESTS_TOGETHER b_test.cpp ...)
#
# A module is one folder of src/: a library `covary_<name>` made of SOURCES, which may use only the modules it DEPENDS
# on (tests/layers checks the includes), and one program `<name>_tests` made of the TESTS that lie beside the code.
# HEADERS are those for other programs, installed with all that they include (CovaryLibrary.cmake). The SOURCES of a
# module of many small files are compiled TOGETHER.
function(covary_module name)
  cmake_parse_arguments(MODULE "TOGETHER" "" "SOURCES;HEADERS;DEPENDS;TESTS;TESTS_TOGETHER;TEST_DEPENDS" ${ARGN})
  if(MODULE_SOURCES)
    add_library(covary_${name} STATIC ${MODULE_SOURCES})
    covary_precompile(covary_${name})
    if(MODULE_TOGETHER)
      covary_together(covary_${name})
    endif()
    set(scope PUBLIC)
  else()
    add_library(covary_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(covary_${name} ${scope} ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
  target_link_libraries(covary_${name} ${scope} covary_options ${MODULE_DEPENDS})
  set_property(GLOBAL APPEND PROPERTY COVARY_MODULES ${name})
  list(TRANSFORM MODULE_HEADERS PREPEND ${name}/)
  set_property(GLOBAL APPEND PROPERTY COVARY_HEADERS ${MODULE_HEADERS})
  if((MODULE_TESTS OR MODULE_TESTS_TOGETHER) AND COVARY_TESTS)
    covary_test(${name}_tests SOURCES ${MODULE_TESTS} TOGETHER ${MODULE_TESTS_TOGETHER}
      DEPENDS covary_${name} ${MODULE_TEST_DEPENDS})
  endif()
endfunction()

# covary_together(<target>): its files are compiled eight at a time, which takes half of the time: what they include is
# read, and its templates are made, once. So no two of them may define the same name, not even in an anonymous
# namespace. The presets for development compile every file by itself.
function(covary_together target)
  if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    # GCC takes every file but the one that it was given for a header.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# covary_test(<program> SOURCES ... TOGETHER ... DEPENDS ... [LABEL statistical|nightly]): a GoogleTest program, each of
# its tests known to CTest. Of its files, those that are TOGETHER are compiled so.
function(covary_test program)
  cmake_parse_arguments(TEST "" "LABEL" "SOURCES;TOGETHER;DEPENDS" ${ARGN})
  add_executable(${program} ${TEST_SOURCES} ${TEST_TOGETHER})
  if(TEST_TOGETHER)
    covary_together(${program})
    set_source_files_properties(${TEST_SOURCES} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  target_include_directories(${program} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${program} PRIVATE ${TEST_DEPENDS} GTest::gtest_main)
  covary_test_options(${program})
  covary_precompile(${program})
  # Only files that name it know where the source tree lies: the others compile to the same object in every checkout, so
  # a compiler cache serves them all.
  foreach(source ${TEST_SOURCES} ${TEST_TOGETHER})
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE path)
    file(STRINGS ${path} uses REGEX COVARY_SOURCE_DIR LIMIT_COUNT 1)
    if(uses)
      set_source_files_properties(${source} PROPERTIES COMPILE_DEFINITIONS COVARY_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    endif()
  endforeach()
  gtest_discover_tests(${program} DISCOVERY_TIMEOUT 60 DISCOVERY_MODE PRE_TEST PROPERTIES LABELS "${TEST_LABEL}")
endfunction()
