# terracast_warnings: the warning set of every target of ours.
add_library(terracast_warnings INTERFACE)
target_compile_options(terracast_warnings INTERFACE -Wall -Wextra -Wnon-virtual-dtor
  -Woverloaded-virtual -Wcast-align -Wunused -Wpedantic -Wdouble-promotion
  # g++ 12 warns of its own std::string (bugs 105329, 105651).
  -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds
  # In a batch a local variable may have the name of another source's constant, and to g++ every source but the batch
  # itself is a header.
  $<IF:$<BOOL:${TERRACAST_UNITY}>,-Wshadow=local$<SEMICOLON>-Wno-subobject-linkage,-Wshadow>
  $<$<BOOL:${TERRACAST_WERROR}>:-Werror>)
