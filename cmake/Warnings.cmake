# terracast_warnings: the warning set of every target of ours.
add_library(terracast_warnings INTERFACE)
target_compile_options(terracast_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
  -Woverloaded-virtual -Wcast-align -Wunused -Wpedantic -Wdouble-promotion
  -Wno-restrict -Wno-stringop-overflow # g++ 12 warns of its own std::string (bug 105651)
  $<$<BOOL:${TERRACAST_WERROR}>:-Werror>)
