# One compiler set-up for the whole build: instruction sets are never chosen file by file, because
# Eigen's alignment and inline functions follow -march.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})

set(TERRACAST_TESTS AUTO CACHE STRING "Build the tests: ON, OFF, or AUTO: where their libraries are installed.")
option(TERRACAST_BENCHMARKS "Build the benchmarks." OFF)
option(TERRACAST_WERROR "Warnings are errors." OFF)
option(TERRACAST_UNITY "Compile each library's sources in batches." ON)
set(TERRACAST_HOT_OPTIONS "" CACHE STRING "Compiler options of the libraries on a ray's way, after those of all.")
set(TERRACAST_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them.")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # What ccache must be told to see through precompiled headers; it takes what a source depends on from the compiler
  # (depend) in place of preprocessing each source once more. Paths count from the checkout, so that one checkout
  # takes what another has compiled; files that were written just now, as the precompiled header's own, count by what
  # they hold.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_DEPEND=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
endif()

# Results must not depend on whether the compiler contracts a*b+c, nor on the rounding of denormals.
add_compile_options(-ffp-contract=off)
# A program of tests may link an instrumented copy of a source before the library's own (tests/sanitized): a caller in the
# batch of that source must not count on the registers and the stack that the library's copy leaves alone.
add_compile_options($<$<CXX_COMPILER_ID:GNU>:-fno-ipa-ra> $<$<CXX_COMPILER_ID:GNU>:-fno-ipa-stack-alignment>)
# Nobody reads errno after a square root; without it loops of them become vector code.
add_compile_options(-fno-math-errno)
# At -O3 GCC 12 makes a copy of vector's assignment for vectors that are empty, and warns of a branch in it that is never
# taken then. The preset dev keeps the warning.
add_compile_options($<$<CONFIG:Release>:-Wno-nonnull>)
# A dependency's header may carry a private fmt built without exceptions; the weak symbols would win.
add_compile_definitions(FMT_EXCEPTIONS=1)

if(TERRACAST_SANITIZE)
  add_compile_options(-fsanitize=${TERRACAST_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TERRACAST_SANITIZE})
endif()
