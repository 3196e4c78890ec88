# covary_embed(<module> a.css b.js ...)
#
# Compiles the content of files into covary_<module>. Each becomes a `std::string_view` in the namespace
# covary::<module>_files, named like the file with '_' for what an identifier cannot hold (page.css: page_css); the
# module includes "<module>/embedded.h", which declares them.
function(covary_embed module)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/embedded)
  set(sources)
  set(declarations)
  foreach(file ${ARGN})
    get_filename_component(file ${file} ABSOLUTE)
    get_filename_component(name ${file} NAME)
    string(MAKE_C_IDENTIFIER ${name} identifier)
    set(source ${folder}/${module}/${identifier}.cpp)
    add_custom_command(OUTPUT ${source}
      COMMAND ${CMAKE_COMMAND} -DFILE=${file} -DSOURCE=${source} -DMODULE=${module} -DIDENTIFIER=${identifier}
              -P ${PROJECT_SOURCE_DIR}/cmake/EmbedFile.cmake
      DEPENDS ${file} ${PROJECT_SOURCE_DIR}/cmake/EmbedFile.cmake
      COMMENT "Embedding ${name}" VERBATIM)
    list(APPEND sources ${source})
    string(APPEND declarations "extern const std::string_view ${identifier};\n")
  endforeach()
  file(CONFIGURE OUTPUT ${folder}/${module}/embedded.h CONTENT
    "#pragma once\n#include <string_view>\nnamespace covary::${module}_files {\n${declarations}}\n")
  target_sources(covary_${module} PRIVATE ${sources})
  target_include_directories(covary_${module} PRIVATE ${folder})
endfunction()
