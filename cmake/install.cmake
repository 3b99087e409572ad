# Defines which files `cmake --install` installs in which folders, and links the data to the same relative places in the
# build folder. A program finds its data relative to its own location (common/base/folders.hpp). It therefore works in
# the build folder, after installation, and after the prefix was moved.
include(GNUInstallDirs)

set(tandem_data ${CMAKE_INSTALL_DATADIR}/tandem)
file(RELATIVE_PATH TANDEM_DATA_FROM_PROGRAM ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_DATADIR}/tandem)
cmake_path(SET tandem_built_data NORMALIZE ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/${TANDEM_DATA_FROM_PROGRAM})

# tandem_data(SOURCE PLACE): installs a file or folder of the source tree as data. In the build folder it is a link.
function(tandem_data source place)
  cmake_path(GET place PARENT_PATH above)
  file(MAKE_DIRECTORY ${tandem_built_data}/${above})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${source} ${tandem_built_data}/${place} SYMBOLIC)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${source})
    install(DIRECTORY ${source}/ DESTINATION ${tandem_data}/${place})
  else()
    install(FILES ${source} DESTINATION ${tandem_data}/${above})
  endif()
endfunction()

tandem_data(server/scenes scenes)
tandem_data(client/view/pictures/scenes pictures)
tandem_data(lab/experiments experiments)
tandem_data(lab/paths paths)
tandem_data(lab/links links)
tandem_data(devices/profiles.json devices/profiles.json)

# udev reads only /usr/lib. For another prefix the file must be copied by the administrator.
install(FILES deploy/udev/70-tandem.rules DESTINATION lib/udev/rules.d)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

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
  endif()")
