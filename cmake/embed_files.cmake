# Writes OUTPUT, a C++ source with the texts of files, so that the program needs no files at run time. The source
# defines NAMESPACE::FUNCTION() of HEADER, a map from the names of the files to their texts.
#
#   cmake -DOUTPUT=... -DFOLDER=... -DFILES=a;b -DHEADER=... -DNAMESPACE=... -DFUNCTION=... -P embed_files.cmake
set(text "#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n\nconst std::map<std::string_view, std::string_view>& ${FUNCTION}() {\n  static const std::map<std::string_view, std::string_view> kFiles = {\n")
foreach(name IN LISTS FILES)
  file(READ "${FOLDER}/${name}" content)
  string(APPEND text "{\"${name}\", R\"~file~(${content})~file~\"},\n")
endforeach()
string(APPEND text "  };\n  return kFiles;\n}\n\n}  // namespace ${NAMESPACE}\n")
file(WRITE "${OUTPUT}" "${text}")
