# terracast_warnings: the warning set of every target of ours.
add_library(terracast_warnings INTERFACE)
target_compile_options(terracast_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
  -Woverloaded-virtual -Wcast-align -Wunused -Wpedantic -Wdouble-promotion
  # g++ 12 warns of its own std::string (bugs 105329, 105651).
  -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds
  $<$<BOOL:${TERRACAST_WERROR}>:-Werror>)
