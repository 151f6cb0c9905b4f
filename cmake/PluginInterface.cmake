# What plug-ins are built against: the headers of the interfaces, a hash of them that tells one build's from another's,
# and their installation with the CMake package `terracast`.
#
# terracast_interface_hash(TARGET): makes plugins/interface_hash.h for TARGET, anew whenever a header has changed.
# Run as a script (cmake -P) it makes the file.
set(TERRACAST_INTERFACE_FOLDERS core geo capture world tiler scene sensors export validate plugins)

if(CMAKE_SCRIPT_MODE_FILE)
  cmake_minimum_required(VERSION 3.25)
  set(hashes)
  foreach(folder IN LISTS TERRACAST_INTERFACE_FOLDERS)
    file(GLOB_RECURSE headers RELATIVE ${ROOT} ${ROOT}/${folder}/*.h)
    list(SORT headers)
    foreach(header IN LISTS headers)
      file(SHA256 ${ROOT}/${header} hash)
      string(APPEND hashes "${header} ${hash}\n")
    endforeach()
  endforeach()
  file(SHA256 ${CLASSES} hash)
  string(SHA256 all "${hashes}${hash}")
  string(SUBSTRING ${all} 0 32 all)
  # Written only when it changes.
  file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT
    "#pragma once\n\n#define TERRACAST_INTERFACE_VERSION \"@VERSION@\"\n#define TERRACAST_INTERFACE_HASH \"@all@\"\n")
  file(TOUCH ${STAMP})
  return()
endif()

function(terracast_interface_hash target)
  set(headers)
  foreach(folder IN LISTS TERRACAST_INTERFACE_FOLDERS)
    file(GLOB_RECURSE more CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.h)
    list(APPEND headers ${more})
  endforeach()
  set(output ${PROJECT_BINARY_DIR}/generated/plugins/interface_hash.h)
  set(stamp ${PROJECT_BINARY_DIR}/interface_hash.stamp)
  set(classes ${PROJECT_SOURCE_DIR}/configs/classes.toml)
  add_custom_command(OUTPUT ${stamp} BYPRODUCTS ${output}
    COMMAND ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -DCLASSES=${classes} -DVERSION=${PROJECT_VERSION}
            -DOUTPUT=${output} -DSTAMP=${stamp} -P ${PROJECT_SOURCE_DIR}/cmake/PluginInterface.cmake
    DEPENDS ${headers} ${classes} ${PROJECT_SOURCE_DIR}/cmake/PluginInterface.cmake
    COMMENT "Hashing the interfaces of plug-ins" VERBATIM)
  target_sources(${target} PRIVATE ${stamp})
  target_include_directories(${target} PUBLIC ${PROJECT_BINARY_DIR}/generated)
endfunction()

# terracast_installs_interfaces(PROGRAM…): the programs, the headers, and the CMake package with terracast_add_plugin().
function(terracast_installs_interfaces)
  include(GNUInstallDirs)
  include(CMakePackageConfigHelpers)
  install(TARGETS ${ARGN} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  set(include_folder ${CMAKE_INSTALL_INCLUDEDIR}/terracast)
  foreach(folder IN LISTS TERRACAST_INTERFACE_FOLDERS)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${include_folder} FILES_MATCHING PATTERN "*.h")
  endforeach()
  install(DIRECTORY ${PROJECT_BINARY_DIR}/generated/ DESTINATION ${include_folder} FILES_MATCHING PATTERN "*.h")
  set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/terracast)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/terracastConfig.cmake.in
    ${PROJECT_BINARY_DIR}/terracastConfig.cmake INSTALL_DESTINATION ${package_folder}
    PATH_VARS CMAKE_INSTALL_INCLUDEDIR)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/terracastConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/terracastConfig.cmake ${PROJECT_BINARY_DIR}/terracastConfigVersion.cmake
    DESTINATION ${package_folder})
endfunction()
