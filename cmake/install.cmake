# Defines which files `cmake --install` installs in which folders, and links the data to the same relative places in the
# build folder. A program finds its data relative to its own location (common/base/folders.hpp). It therefore works in
# the build folder, after installation, and after the prefix was moved. The component of a file is the name of its Debian
# package (deploy/package).
include(GNUInstallDirs)

set(tandem_data ${CMAKE_INSTALL_DATADIR}/tandem)
file(RELATIVE_PATH TANDEM_DATA_FROM_PROGRAM ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_DATADIR}/tandem)
file(RELATIVE_PATH TANDEM_PROGRAMS_FROM_LIBRARY ${CMAKE_INSTALL_FULL_LIBDIR} ${CMAKE_INSTALL_FULL_BINDIR})
file(RELATIVE_PATH tandem_library_from_programs ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
cmake_path(SET tandem_built_data NORMALIZE ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/${TANDEM_DATA_FROM_PROGRAM})

# tandem_data(SOURCE PLACE COMPONENT): installs a file or folder of the source tree as data. In the build folder it is a
# link.
function(tandem_data source place component)
  cmake_path(GET place PARENT_PATH above)
  file(MAKE_DIRECTORY ${tandem_built_data}/${above})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${source} ${tandem_built_data}/${place} SYMBOLIC)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${source})
    install(DIRECTORY ${source}/ DESTINATION ${tandem_data}/${place} COMPONENT ${component} PATTERN *.py EXCLUDE)
  else()
    install(FILES ${source} DESTINATION ${tandem_data}/${above} COMPONENT ${component})
  endif()
endfunction()

# tandem_install_programs(COMPONENT program...): installs programs with their manual pages and bash completions, which
# Python makes from their --help. Programs of another architecture cannot be run here, so they are installed without.
function(tandem_install_programs component)
  install(TARGETS ${ARGN} COMPONENT ${component})
  if(NOT CMAKE_CROSSCOMPILING)
    list(JOIN ARGN " " programs)
    install(CODE "execute_process(COMMAND_ERROR_IS_FATAL ANY COMMAND
      \"${PROJECT_SOURCE_DIR}/deploy/make_manual\" --bin \"${CMAKE_RUNTIME_OUTPUT_DIRECTORY}\"
      --share \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}\"
      --version-text \"Tandem ${PROJECT_VERSION}\" ${programs})" COMPONENT ${component})
  endif()
endfunction()

tandem_data(server/scenes scenes tandem-common)
tandem_data(client/view/pictures/scenes pictures tandem-client)
tandem_data(lab/experiments experiments tandem-lab)
tandem_data(lab/paths paths tandem-lab)
tandem_data(lab/links links tandem-lab)
tandem_data(devices/profiles.json devices/profiles.json tandem-common)

# udev reads only /usr/lib. For another prefix the file must be copied by the administrator.
install(FILES deploy/udev/70-tandem.rules DESTINATION lib/udev/rules.d COMPONENT tandem-client)
install(FILES deploy/desktop/tandem-client.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT tandem-client)
install(FILES deploy/desktop/tandem.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps
  COMPONENT tandem-client)
install(FILES deploy/desktop/tandem-client.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo
  COMPONENT tandem-client)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)

# Installs the server as a systemd service. The unit names its program and its configuration with the prefix that is
# given at installation (cmake --install BUILD --prefix PREFIX). An existing configuration is not replaced.
install(CODE "
  set(TANDEM_PROGRAM \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/tandem-server\")
  if(\"\${CMAKE_INSTALL_PREFIX}\" STREQUAL /usr)
    set(sysconf /etc)
  else()
    set(sysconf \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_SYSCONFDIR}\")
  endif()
  set(TANDEM_CONFIG \"\${sysconf}/tandem/tandem-server.conf\")
  configure_file(\"${PROJECT_SOURCE_DIR}/deploy/tandem-server.service.in\"
    \"${PROJECT_BINARY_DIR}/tandem-server.service\" @ONLY)
  file(INSTALL \"${PROJECT_BINARY_DIR}/tandem-server.service\"
    DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/systemd/system\")
  if(NOT EXISTS \"\$ENV{DESTDIR}\${TANDEM_CONFIG}\")
    file(INSTALL \"${PROJECT_SOURCE_DIR}/deploy/tandem-server.conf\" DESTINATION \"\${sysconf}/tandem\")
  endif()" COMPONENT tandem-server)
