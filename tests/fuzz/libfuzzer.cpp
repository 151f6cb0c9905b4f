// Entry of libFuzzer. The environment says which reader is fuzzed: TERRACAST_FUZZ_READER=npy terracast_fuzz …
// TERRACAST_FUZZ_READER=list prints their names.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "tests/fuzz/targets.h"

namespace {

const terracast::fuzz::Target* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* name = std::getenv("TERRACAST_FUZZ_READER");
  if (name != nullptr && std::string(name) == "list") {
    for (const auto& target : terracast::fuzz::targets())
      std::printf("%.*s\n", static_cast<int>(target.name.size()), target.name.data());
    std::exit(0);
  }
  chosen = terracast::fuzz::find_target(name == nullptr ? "" : name);
  if (chosen == nullptr) {
    std::fprintf(stderr, "TERRACAST_FUZZ_READER names no reader; \"list\" prints them\n");
    std::exit(2);
  }
  terracast::fuzz::prepare();
  // What the reader makes once, such as the dataset whose files are replaced, is made before an input is timed.
  try {
    terracast::fuzz::run(*chosen, {});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "FOUND, by no bytes at all: %s\n", error.what());
    std::abort();
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    terracast::fuzz::run(*chosen, {reinterpret_cast<const std::byte*>(data), size});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "FOUND: %s\n", error.what());
    std::abort();
  }
  return 0;
}
