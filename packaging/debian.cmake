# Debian packages of the components, made by cpack. What is in them is said in CMakeLists.txt; here is what a package is beside
# its files. The maintainer scripts are in debian/.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME bmud)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "bmud developers <developers@bmud.example>")
# Each package has a summary of its own, the first line of its description.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_COMPONENTS_ALL bmud bmud-tools mmusim)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Folders that users may share or link elsewhere are made as Debian has them, whatever the umask of the moment.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_COMPONENT_BMUD_DESCRIPTION "master of a distributed battery management system on CAN
bmud polls the units that measure the cells of a traction pack, checks the
limit and the age of every value, controls the contactors, estimates charge
and health, and reports to the vehicle with the messages 620h to 628h. It runs
as a service on a Linux machine with SocketCAN.")
set(CPACK_COMPONENT_BMUD-TOOLS_DESCRIPTION "tools around the battery management master bmud
bmuctl queries and controls a running daemon, bmudump decodes the frames of
the battery's buses and candump's logs, bmureplay replays a recording through
the core, bmucell fits cell files and scores estimators.")
set(CPACK_COMPONENT_MMUSIM_DESCRIPTION "scripted battery pack on a CAN bus, for testing bmud without hardware
mmusim emulates module units, current sensor, power distribution unit and
charger for a battery management master, from a model of the pack with its
currents and its heat, with or without a script.")

set(CPACK_DEBIAN_BMUD_PACKAGE_NAME bmud)
set(CPACK_DEBIAN_BMUD_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_BMUD_PACKAGE_DEPENDS "systemd, init-system-helpers (>= 1.54)")
set(CPACK_DEBIAN_BMUD_PACKAGE_RECOMMENDS "bmud-tools")
set(CPACK_DEBIAN_BMUD_PACKAGE_SUGGESTS "can-utils, mmusim")
set(CPACK_DEBIAN_BMUD-TOOLS_PACKAGE_NAME bmud-tools)
set(CPACK_DEBIAN_BMUD-TOOLS_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_BMUD-TOOLS_PACKAGE_SUGGESTS "bmud")
set(CPACK_DEBIAN_MMUSIM_PACKAGE_NAME mmusim)
set(CPACK_DEBIAN_MMUSIM_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_MMUSIM_PACKAGE_SUGGESTS "bmud")

set(scripts ${CMAKE_CURRENT_SOURCE_DIR}/debian)
set(CPACK_DEBIAN_BMUD_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm ${scripts}/postrm ${scripts}/conffiles)

# What Debian wants beside each package's files. Its changelog is that of the packages; ours is the program's.
set(changelog ${made}/changelog.gz)
set(debian_changelog ${made}/changelog.Debian.gz)
add_custom_command(OUTPUT ${changelog} COMMAND sh -ec "gzip -9nc '${CMAKE_SOURCE_DIR}/CHANGELOG.md' >'${changelog}'"
  DEPENDS ${CMAKE_SOURCE_DIR}/CHANGELOG.md VERBATIM)
add_custom_command(OUTPUT ${debian_changelog} COMMAND sh -ec "gzip -9nc '${scripts}/changelog' >'${debian_changelog}'"
  DEPENDS ${scripts}/changelog VERBATIM)
add_custom_target(changelogs ALL DEPENDS ${changelog} ${debian_changelog})
foreach(component ${CPACK_COMPONENTS_ALL})
  install(FILES ${scripts}/copyright ${changelog} ${debian_changelog} DESTINATION ${doc_dir}/${component} COMPONENT ${component})
endforeach()

include(CPack)
