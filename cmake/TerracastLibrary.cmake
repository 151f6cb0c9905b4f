# Parsed once: what nearly every source includes, and takes half of its compile to read. A source includes what it uses
# all the same; the preset asan builds without this list.
set(precompiled_headers <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory>
    <optional> <set> <span> <string> <string_view> <vector> <Eigen/Geometry> <fmt/format.h>)
set(precompiled_test_headers ${precompiled_headers} <gmock/gmock.h> <gtest/gtest.h>)

# terracast_library(NAME USES folder... LINKS target...)
#   The folder's sources as the library terracast_NAME. USES is the folder's row of the layering: it links
#   those libraries and becomes the CTest layering.NAME, which reads the includes. LINKS are third parties.
function(terracast_library name)
  cmake_parse_arguments(ARG "" "" "USES;LINKS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.h)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  if(sources)
    add_library(terracast_${name} STATIC ${sources} ${headers})
    set(scope PUBLIC)
    target_link_libraries(terracast_${name} PRIVATE terracast_warnings)
    if(name STREQUAL core)
      target_precompile_headers(terracast_core PRIVATE ${precompiled_headers})
    else()
      target_precompile_headers(terracast_${name} REUSE_FROM terracast_core)
    endif()
  else()
    add_library(terracast_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(terracast_${name} ${scope} ${PROJECT_SOURCE_DIR})
  list(TRANSFORM ARG_USES PREPEND terracast_ OUTPUT_VARIABLE used)
  target_link_libraries(terracast_${name} ${scope} ${used} ${ARG_LINKS} Eigen3::Eigen fmt::fmt)
  terracast_check_layering(${name} "${ARG_USES}")
endfunction()

# terracast_tests(FOLDER USES folder... LINKS target... LABEL label [IN_ONE_PROCESS])
#   tests/FOLDER/*_test.cpp as one GoogleTest program, terracast_FOLDER_tests. Each test is a CTest of its own, or all
#   are one, IN_ONE_PROCESS: for tests that share what takes longer to make than to test.
function(terracast_tests folder)
  cmake_parse_arguments(ARG "IN_ONE_PROCESS" "LABEL" "USES;LINKS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${folder}/*.cpp
       ${PROJECT_SOURCE_DIR}/tests/${folder}/*.h)
  if(NOT sources)
    return()
  endif()
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  # The long ones first, so that both cores are busy to the end.
  if(ARG_LABEL STREQUAL e2e OR ARG_IN_ONE_PROCESS)
    set(cost COST 1000)
  endif()
  set(target terracast_${folder}_tests)
  add_executable(${target} ${sources})
  list(TRANSFORM ARG_USES PREPEND terracast_ OUTPUT_VARIABLE used)
  target_link_libraries(${target} PRIVATE ${used} ${ARG_LINKS} terracast_test_support
    terracast_warnings GTest::gtest_main GTest::gmock)
  # g++ 12 warns of its own std::string (bug 105329) where that is precompiled.
  target_compile_options(${target} PRIVATE -Wno-array-bounds)
  if(folder STREQUAL core)
    target_precompile_headers(${target} PRIVATE ${precompiled_test_headers})
  else()
    target_precompile_headers(${target} REUSE_FROM terracast_core_tests)
  endif()
  if(ARG_IN_ONE_PROCESS)
    add_test(NAME ${folder} COMMAND ${target} --gtest_brief=1)
    set_tests_properties(${folder} PROPERTIES LABELS ${ARG_LABEL} ${cost})
    return()
  endif()
  gtest_discover_tests(${target} DISCOVERY_MODE PRE_TEST TEST_PREFIX ${folder}.
    PROPERTIES LABELS ${ARG_LABEL} ${cost})
endfunction()
if(TERRACAST_TESTS)
  include(GoogleTest)
endif()
