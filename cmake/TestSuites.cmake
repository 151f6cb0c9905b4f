# Read by ctest: makes a CTest of each suite of a GoogleTest program, so that what a suite makes once is made once.
# program, prefix, filter (of GoogleTest), labels and properties (of each CTest): set by what includes this.
if(NOT EXISTS ${program})
  add_test(${prefix}.NOT_BUILT ${program})
  return()
endif()
execute_process(COMMAND ${program} --gtest_list_tests --gtest_filter=${filter} OUTPUT_VARIABLE listed
                RESULT_VARIABLE status TIMEOUT 60)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${program} cannot list its tests: ${status}")
endif()
# Suites stand at the start of their line, their tests indented.
string(REGEX MATCHALL "(^|\n)[A-Za-z][^ \n]*\\." suites "${listed}")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "^\n|\\.$" "" suite "${suite}")
  add_test(${prefix}.${suite} ${program} --gtest_filter=${suite}.*)
  set_tests_properties(${prefix}.${suite} PROPERTIES LABELS "${labels}" ${properties})
endforeach()
