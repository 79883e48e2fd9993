# Writes OUTPUT: a C++ source with the texts of the page's files, so that the program needs no files of its own at run time.
# Called as: cmake -DOUTPUT=... -DFOLDER=... -DFILES=a;b -P embed_page.cmake
set(text "#include \"replay/report/page_files.h\"\n\nnamespace tessera::replay {\n\nconst std::map<std::string_view, std::string_view>& page_files() {\n  static const std::map<std::string_view, std::string_view> kFiles = {\n")
foreach(name IN LISTS FILES)
  file(READ "${FOLDER}/${name}" content)
  string(APPEND text "{\"${name}\", R\"~page~(${content})~page~\"},\n")
endforeach()
string(APPEND text "  };\n  return kFiles;\n}\n\n}  // namespace tessera::replay\n")
file(WRITE "${OUTPUT}" "${text}")
