# Installs the headers HEADERS of SOURCE, and all that they include, into FOLDER of the prefix. Run by
# `cmake --install`. There they include each other as "covary/core/error.h", so that a program's own core/error.h does
# not get in their way.
set(done)
while(headers)
  list(POP_FRONT headers header)
  list(APPEND done ${header})
  file(READ ${source}/${header} text)
  string(REGEX MATCHALL "\n#include \"[^\"]+" includes "${text}")
  list(TRANSFORM includes REPLACE "\n#include \"" "")
  list(APPEND headers ${includes})
  list(REMOVE_DUPLICATES headers)
  list(REMOVE_ITEM headers ${done})
  string(REGEX REPLACE "(\n#include \")" "\\1covary/" text "${text}")
  file(WRITE ${work}/headers/${header} "${text}")
  get_filename_component(module ${header} DIRECTORY)
  file(INSTALL ${work}/headers/${header} DESTINATION ${CMAKE_INSTALL_PREFIX}/${folder}/${module})
endwhile()
