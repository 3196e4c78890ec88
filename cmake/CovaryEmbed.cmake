# covary_embed(<room> a.css b.js ...)
#
# Compiles the content of files into covary_<room>. Each becomes a `std::string_view` in the namespace
# covary::<room>_files, named like the file with '_' for what an identifier cannot hold (page.css: page_css); the room
# includes "<room>/embedded.h", which declares them.
function(covary_embed room)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/embedded)
  set(sources)
  set(declarations)
  foreach(file ${ARGN})
    get_filename_component(file ${file} ABSOLUTE)
    get_filename_component(name ${file} NAME)
    string(MAKE_C_IDENTIFIER ${name} identifier)
    set(source ${folder}/${room}/${identifier}.cpp)
    add_custom_command(OUTPUT ${source}
      COMMAND ${CMAKE_COMMAND} -DFILE=${file} -DSOURCE=${source} -DROOM=${room} -DIDENTIFIER=${identifier}
              -P ${PROJECT_SOURCE_DIR}/cmake/EmbedFile.cmake
      DEPENDS ${file} ${PROJECT_SOURCE_DIR}/cmake/EmbedFile.cmake
      COMMENT "Embedding ${name}" VERBATIM)
    list(APPEND sources ${source})
    string(APPEND declarations "extern const std::string_view ${identifier};\n")
  endforeach()
  file(CONFIGURE OUTPUT ${folder}/${room}/embedded.h CONTENT
    "#pragma once\n#include <string_view>\nnamespace covary::${room}_files {\n${declarations}}\n")
  target_sources(covary_${room} PRIVATE ${sources})
  target_include_directories(covary_${room} PRIVATE ${folder})
endfunction()
