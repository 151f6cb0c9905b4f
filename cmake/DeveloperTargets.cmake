# format, tidy: the clang tools over our sources. headers: every header compiles alone. coverage: lines that ctest ran.
file(GLOB_RECURSE our_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/*.cpp)
file(GLOB_RECURSE our_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/*.h)
list(FILTER our_sources EXCLUDE REGEX "/build/")
list(FILTER our_headers EXCLUDE REGEX "/build/")

find_program(CLANG_FORMAT clang-format)
if(CLANG_FORMAT)
  add_custom_target(format COMMAND ${CLANG_FORMAT} -i ${our_sources} ${our_headers} VERBATIM)
  add_custom_target(format-check COMMAND ${CLANG_FORMAT} --dry-run -Werror ${our_sources} ${our_headers} VERBATIM)
endif()

find_program(RUN_CLANG_TIDY run-clang-tidy)
if(RUN_CLANG_TIDY)
  # It reads the compile commands of a folder of its own, without g++'s precompiled headers.
  add_custom_target(tidy
    COMMAND ${CMAKE_COMMAND} -G Ninja -S ${PROJECT_SOURCE_DIR} -B ${PROJECT_BINARY_DIR}/tidy
            -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
    COMMAND ${RUN_CLANG_TIDY} -quiet -p ${PROJECT_BINARY_DIR}/tidy
    -extra-arg=-Wno-unknown-warning-option  # those are for g++
    # CGAL's headers take it more than a minute.
    "${PROJECT_SOURCE_DIR}/(core|geo|capture|world|tiler|render|export|validate|cli)/(?!oracle/exact_terrain).*\\.cpp$"
    VERBATIM)
endif()

set(header_checks)
foreach(header IN LISTS our_headers)
  file(RELATIVE_PATH relative ${PROJECT_SOURCE_DIR} ${header})
  string(REPLACE "/" "_" name ${relative})
  set(check ${PROJECT_BINARY_DIR}/headers/${name}.cpp)
  file(CONFIGURE OUTPUT ${check} CONTENT "#include \"${relative}\"\n")
  list(APPEND header_checks ${check})
endforeach()
if(TERRACAST_TESTS)
  add_library(headers OBJECT EXCLUDE_FROM_ALL ${header_checks})
  target_include_directories(headers PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(headers PRIVATE terracast_warnings terracast_cli terracast_test_support GTest::gtest)
endif()

find_program(GCOVR gcovr)
if(GCOVR)
  add_custom_target(coverage
    COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/coverage
    COMMAND ${GCOVR} --root ${PROJECT_SOURCE_DIR} --exclude ${PROJECT_SOURCE_DIR}/tests --exclude ${PROJECT_BINARY_DIR}
            --html-details ${PROJECT_BINARY_DIR}/coverage/index.html --print-summary ${PROJECT_BINARY_DIR}
    VERBATIM)
endif()
