#include "tests/e2e/fake_clock.h"

#include "tests/support/run_program.h"

namespace terracast::test {

namespace fs = std::filesystem;

FakeClock::FakeClock() {
  // The wrapper knows where its library lies, as the loader is told it.
  const auto found = run_command("/usr/bin/env", {"faketime", "-m", "-f", "+0s", "/bin/sh", "-c",
                                                  "printf %s \"$LD_PRELOAD\""});
  if (found.status == 0) library_ = found.output;
}

FakeClock::Environment FakeClock::shifted(const std::string& offset, bool with_steady) const {
  Environment environment = {{"LD_PRELOAD", library_}, {"FAKETIME", offset}};
  if (!with_steady) environment.emplace_back("FAKETIME_DONT_FAKE_MONOTONIC", "1");
  return environment;
}

FakeClock::Environment FakeClock::by_file(const fs::path& file) const {
  return {{"LD_PRELOAD", library_},
          {"FAKETIME_TIMESTAMP_FILE", file.string()},
          {"FAKETIME_NO_CACHE", "1"},
          {"FAKETIME_DONT_FAKE_MONOTONIC", "1"}};
}

}  // namespace terracast::test
