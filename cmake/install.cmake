# `cmake --install` installs the program with its manual page, completion and JSON schemas, the library, headers,
# CMake package and Python module; `cpack` makes a Debian package of them.
include(CMakePackageConfigHelpers)

# The install step first builds missing targets, as `./tessera` builds the program alone; so nothing is half installed.
set(installed_targets tessera tessera_shared)
if(TESSERA_PYTHON)
  list(APPEND installed_targets tessera_python)
endif()
# The program prints its manual page, completions and schemas.
set(printed_folder ${PROJECT_BINARY_DIR}/printed)
install(CODE "
  execute_process(COMMAND \"${CMAKE_COMMAND}\" --build \"${PROJECT_BINARY_DIR}\" --target ${installed_targets}
    COMMAND_ERROR_IS_FATAL ANY)
  function(tessera_print file)
    execute_process(COMMAND \"$<TARGET_FILE:tessera>\" describe \${ARGN} OUTPUT_FILE \"${printed_folder}/\${file}\" COMMAND_ERROR_IS_FATAL ANY)
  endfunction()
  file(MAKE_DIRECTORY \"${printed_folder}/schemas\")
  tessera_print(tessera.1 man)
  tessera_print(tessera completion bash)
  tessera_print(_tessera completion zsh)
  execute_process(COMMAND \"$<TARGET_FILE:tessera>\" describe schema OUTPUT_VARIABLE names COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL \"[a-z]+\" names \"\${names}\")
  foreach(name IN LISTS names)
    tessera_print(schemas/\${name}.schema.json schema \${name})
  endforeach()
")

install(TARGETS tessera RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# Debian's zsh looks for completions here; other systems set -DTESSERA_ZSH_FOLDER=share/zsh/site-functions.
set(TESSERA_ZSH_FOLDER ${CMAKE_INSTALL_DATAROOTDIR}/zsh/vendor-completions CACHE PATH "Completion of zsh, below the prefix")
install(FILES ${printed_folder}/tessera.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${printed_folder}/tessera DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions)
install(FILES ${printed_folder}/_tessera DESTINATION ${TESSERA_ZSH_FOLDER})
install(DIRECTORY ${printed_folder}/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/tessera)
if(TESSERA_PYTHON)
  set(python_folder lib/python3/dist-packages/tessera)
  set(python_files __init__.py __init__.pyi py.typed)
  list(TRANSFORM python_files PREPEND ${PROJECT_SOURCE_DIR}/python/tessera/)
  install(TARGETS tessera_python LIBRARY DESTINATION ${python_folder})
  install(FILES ${python_files} DESTINATION ${python_folder})
endif()
install(TARGETS tessera_shared EXPORT tessera LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/tessera DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/tessera)
install(EXPORT tessera NAMESPACE tessera:: FILE tesseraTargets.cmake DESTINATION ${package_folder})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tesseraConfig.cmake.in
  ${PROJECT_BINARY_DIR}/cmake/tesseraConfig.cmake INSTALL_DESTINATION ${package_folder})
# Until 1.0 every minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/tesseraConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cmake/tesseraConfig.cmake ${PROJECT_BINARY_DIR}/cmake/tesseraConfigVersion.cmake
  DESTINATION ${package_folder})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tessera)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGE_CONTACT "The Tessera developers <tessera@localhost>")
set(CPACK_PACKAGE_VENDOR Tessera)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
# The page of a report draws with Vega.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS libjs-vega)
if(TESSERA_PYTHON)
  set(CPACK_DEBIAN_PACKAGE_DEPENDS
    "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${python_next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PACKAGE_SUGGESTS python3-matplotlib)
endif()
include(CPack)
