# Writes OUTPUT: a C++ source with the text of the table TABLE, so that the library needs no file of its own at run time.
# Called as: cmake -DOUTPUT=... -DTABLE=... -P embed_table.cmake
file(READ "${TABLE}" text)
file(WRITE "${OUTPUT}" "#include <string_view>\n\nnamespace tessera::hardware {\n\nextern const std::string_view kShaderCostTable;\nconst std::string_view kShaderCostTable = R\"~table~(${text})~table~\";\n\n}  // namespace tessera::hardware\n")
