# terracast_page_bundle(TARGET): bundles the report's page (validate/page) with node and npm's packages, and compiles the
# result into TARGET. Packages are fetched when package-lock.json has changed, and never again; the program needs no node.
function(terracast_page_bundle target)
  find_program(NODE_PROGRAM NAMES node nodejs)
  find_program(NPM_PROGRAM npm)
  if(NOT NODE_PROGRAM OR NOT NPM_PROGRAM)
    message(FATAL_ERROR "The page of validation reports is bundled with node and npm, and one of them is missing here: "
      "scripts/install build (Debian's nodejs and npm will do), or set NODE_PROGRAM and NPM_PROGRAM.")
  endif()
  set(source ${PROJECT_SOURCE_DIR}/validate/page)
  set(build ${PROJECT_BINARY_DIR}/page)
  file(GLOB files CONFIGURE_DEPENDS ${source}/src/*.ts ${source}/src/*.css)
  terracast_npm_packages(${source} ${build})
  add_custom_command(OUTPUT ${build}/page_bundle.cpp
    COMMAND ${NODE_PROGRAM} ${source}/bundle.mjs ${build}/node_modules ${build}/page_bundle.cpp
    COMMAND ${CMAKE_COMMAND} -E touch ${build}/page_bundle.cpp
    DEPENDS ${build}/packages.stamp ${source}/bundle.mjs ${source}/tsconfig.json ${files}
    COMMENT "Bundling the report's page" VERBATIM)
  target_sources(${target} PRIVATE ${build}/page_bundle.cpp)
  set_source_files_properties(${build}/page_bundle.cpp PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()

# terracast_npm_packages(SOURCE BUILD): the rule of BUILD/packages.stamp, which stands for BUILD/node_modules as
# SOURCE/package-lock.json wants them. No package's scripts are run.
function(terracast_npm_packages source build)
  add_custom_command(OUTPUT ${build}/packages.stamp
    COMMAND ${CMAKE_COMMAND} -E make_directory ${build}
    COMMAND ${CMAKE_COMMAND} -E copy ${source}/package.json ${source}/package-lock.json ${build}
    COMMAND ${CMAKE_COMMAND} -E chdir ${build} ${NPM_PROGRAM} ci --ignore-scripts --prefer-offline --no-audit --no-fund
            --no-update-notifier --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${build}/packages.stamp
    DEPENDS ${source}/package.json ${source}/package-lock.json
    COMMENT "Fetching the packages of ${source}/package-lock.json" VERBATIM)
endfunction()
