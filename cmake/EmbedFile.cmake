# Writes SOURCE, which defines covary::MODULE_files::IDENTIFIER as the bytes of FILE. Run by covary_embed().
file(READ ${FILE} bytes HEX)
string(REGEX REPLACE "(................................................................)" "\\1\n" bytes "${bytes}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
file(WRITE ${SOURCE} "#include \"${MODULE}/embedded.h\"\n\nnamespace covary::${MODULE}_files {\n"
  "static const char ${IDENTIFIER}_bytes[] = {\n${bytes}'\\0'};\n"
  "const std::string_view ${IDENTIFIER}{${IDENTIFIER}_bytes, sizeof(${IDENTIFIER}_bytes) - 1};\n}\n")
