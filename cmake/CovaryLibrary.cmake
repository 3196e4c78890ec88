# libcovary: all modules in one library, for the programs of others (docs/library.md), and what find_package(covary)
# needs. Static, it is for the processor that COVARY_ARCH names. Shared and with COVARY_HWCAPS it is built three times:
# for x86-64-v2 in lib, with which programs are linked, and for higher levels in lib/glibc-hwcaps/LEVEL, of which the
# loader (glibc >= 2.33) takes the highest that the processor has.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY COVARY_MODULES)
set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})  # below 1.0 each minor version is another interface

list(TRANSFORM modules REPLACE "(.+)" "$<TARGET_OBJECTS:covary_\\1>" OUTPUT_VARIABLE objects)
add_library(covary_library ${objects})
set_target_properties(covary_library PROPERTIES OUTPUT_NAME covary EXPORT_NAME covary LINKER_LANGUAGE CXX
  VERSION ${PROJECT_VERSION} SOVERSION ${soversion}
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib INSTALL_RPATH "$ORIGIN/covary")
target_compile_features(covary_library INTERFACE cxx_std_20)
target_include_directories(covary_library INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
# What has code; static, the programs of others link it, too.
get_property(gltf_libraries GLOBAL PROPERTY COVARY_GLTF_LIBRARIES)
target_link_libraries(covary_library PRIVATE ${gltf_libraries}
  TBB::tbb embree OpenEXR::OpenEXR PNG::PNG JPEG::JPEG ZLIB::ZLIB pugixml::pugixml TinyGLTF::TinyGLTF fmt::fmt
  ${CMAKE_DL_LIBS}
  "$<BUILD_INTERFACE:${XXHASH_LIBRARY}>$<INSTALL_INTERFACE:xxhash>")
if(NOT BUILD_SHARED_LIBS)  # else the library knows by its own RPATH where libcovary_imageio.so lies
  target_link_options(covary_library INTERFACE
    "$<INSTALL_INTERFACE:LINKER:-rpath,$<INSTALL_PREFIX>/${CMAKE_INSTALL_LIBDIR}/covary>")
endif()

# Programs have copies of inline functions and templates of the headers, made for every processor. The library does not
# take them for its own, which are made for this one.
function(covary_keep_own_functions library)
  target_link_options(${library} PRIVATE LINKER:-Bsymbolic-functions)
  if(NOT COVARY_SANITIZE)
    target_link_options(${library} PRIVATE LINKER:--no-undefined)
  endif()
endfunction()

# The same sources once more, for processors of LEVEL.
function(covary_level level)
  set(library covary_library_${level})
  add_library(${library} SHARED)
  target_precompile_headers(${library} PRIVATE ${covary_precompiled_headers})
  foreach(module ${modules})
    set(target covary_${module})
    foreach(property SOURCES SOURCE_DIR INCLUDE_DIRECTORIES LINK_LIBRARIES)
      get_target_property(${property} ${target} ${property})
    endforeach()
    foreach(source ${SOURCES})
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${SOURCE_DIR})
      target_sources(${library} PRIVATE ${source})
    endforeach()
    list(REMOVE_ITEM LINK_LIBRARIES ${module_targets})
    target_include_directories(${library} PRIVATE ${INCLUDE_DIRECTORIES})
    target_link_libraries(${library} PRIVATE ${LINK_LIBRARIES})
    add_dependencies(${library} ${target})  # makes the sources that are generated
  endforeach()
  set_target_properties(${library} PROPERTIES COVARY_LEVEL ${level} OUTPUT_NAME covary
    VERSION ${PROJECT_VERSION} SOVERSION ${soversion}
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/glibc-hwcaps/${level} INSTALL_RPATH "$ORIGIN/../../covary")
  covary_keep_own_functions(${library})
  add_dependencies(covary_library ${library})
  install(TARGETS ${library} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/${level} NAMELINK_SKIP)
endfunction()

if(BUILD_SHARED_LIBS)
  covary_keep_own_functions(covary_library)
endif()
if(COVARY_HWCAPS)
  list(TRANSFORM modules PREPEND covary_ OUTPUT_VARIABLE module_targets)
  covary_level(x86-64-v3)
  covary_level(x86-64-v4)
endif()

# Headers, and the package for find_package().
get_property(headers GLOBAL PROPERTY COVARY_HEADERS)
install(CODE "set(headers ${headers})
set(source \"${PROJECT_SOURCE_DIR}/src\")
set(work \"${PROJECT_BINARY_DIR}\")
set(folder \"${CMAKE_INSTALL_INCLUDEDIR}/covary\")")
install(SCRIPT ${PROJECT_SOURCE_DIR}/cmake/InstallHeaders.cmake)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/covary)
configure_package_config_file(cmake/covaryConfig.cmake.in covaryConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(covaryConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(TARGETS covary_library EXPORT covaryTargets)
install(EXPORT covaryTargets NAMESPACE covary:: DESTINATION ${package})
install(FILES ${PROJECT_BINARY_DIR}/covaryConfig.cmake ${PROJECT_BINARY_DIR}/covaryConfigVersion.cmake
  DESTINATION ${package})

# The same for pkg-config, with no folder of this machine. What libcovary.a needs is linked into the program, too, of
# which embree has no file of pkg-config.
set(requires)
set(libraries)
if(NOT BUILD_SHARED_LIBS)
  set(requires "tbb OpenEXR libpng libjpeg zlib pugixml tinygltf fmt libxxhash")
  get_target_property(configurations embree IMPORTED_CONFIGURATIONS)
  list(GET configurations 0 configuration)
  get_target_property(embree_file embree IMPORTED_LOCATION_${configuration})
  string(REGEX REPLACE ".*/lib(embree[0-9]*)\\..*" "-l\\1" embree_link "${embree_file}")
  get_property(gltf_links GLOBAL PROPERTY COVARY_GLTF_LINKS)
  set(libraries " ${embree_link}${gltf_links} -ldl -Wl,-rpath,\${libdir}/covary")
endif()
file(RELATIVE_PATH prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" prefix "${prefix}")
configure_file(cmake/covary.pc.in covary.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/covary.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
