// Gives every reader of the table its seeds, the cases that were found, and a thousand inputs made of both, under the
// sanitizers. A case that is found is written to a file, which is named.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sanitizer/common_interface_defs.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/mutator.h"
#include "tests/fuzz/targets.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;
using Input = Mutator::Input;

/// Of the processor, under the sanitizers: no input may take longer.
constexpr int kLongest_s = 20;
constexpr std::size_t kNumInputs = 1000;

/// What is being read, for the handlers of signals.
Bytes current;
char case_file[256] = "";

void write_case() {
  const int file = ::open(case_file, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file < 0 || ::write(file, current.data(), current.size()) < 0) return;
  ::close(file);
  for (const char* text :
       {"\nthe input was written to ", static_cast<const char*>(case_file), "\n"})
    if (::write(STDERR_FILENO, text, std::char_traits<char>::length(text)) < 0) return;
}

/// Sets off tell_of_time() when so much time of the processor was used; 0: does not any more.
void allow(int seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = seconds;
  ::setitimer(ITIMER_PROF, &timer, nullptr);
}

void tell_of_time(int) {
  constexpr char kText[] = "\nan input takes too long";
  if (::write(STDERR_FILENO, kText, sizeof kText - 1) < 0) return;
  std::abort();
}

/// Reads an input; what is found fails the test.
/// returns   why the reader refused it; empty: it took it for right
std::string read(const Target& target, const Input& input, const std::string& name) {
  current = input;
  const std::string file = std::string(target.name) + "-" + name;
  case_file[file.copy(case_file, sizeof case_file - 1)] = '\0';
  allow(kLongest_s);
  std::string refused;
  try {
    refused = run(target, input);
  } catch (const std::exception& error) {
    write_case();
    ADD_FAILURE() << error.what() << "\nof the input " << fs::absolute(case_file).string();
  }
  allow(0);
  return refused;
}

struct Case {
  std::string name;
  Input bytes;
};

/// The files kept for a reader, by name.
std::vector<Case> cases_of(const Target& target, const char* kind) {
  const fs::path folder = fs::path(TERRACAST_SOURCE_DIR) / "tests/fuzz" / kind / target.name;
  std::vector<Case> cases;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const Bytes bytes = std::as_bytes(std::span(text));
    cases.push_back({entry.path().filename().string(), {bytes.begin(), bytes.end()}});
  }
  std::sort(cases.begin(), cases.end(),
            [](const Case& a, const Case& b) { return a.name < b.name; });
  return cases;
}

class ReaderTest : public testing::Test {
 public:
  explicit ReaderTest(const Target& target) : target_(target) {}

 protected:
  const Target& target_;
};

class Seeds final : public ReaderTest {
 public:
  using ReaderTest::ReaderTest;
  void TestBody() override {
    const std::vector<Case> seeds = cases_of(target_, "seeds");
    ASSERT_FALSE(seeds.empty()) << "put a right input into tests/fuzz/seeds/" << target_.name;
    for (const Case& one : seeds) EXPECT_EQ(read(target_, one.bytes, one.name), "") << one.name;
  }
};

class FoundCases final : public ReaderTest {
 public:
  using ReaderTest::ReaderTest;
  void TestBody() override {
    for (const Case& one : cases_of(target_, "found")) {
      SCOPED_TRACE(one.name);
      read(target_, one.bytes, one.name);
    }
  }
};

class MadeInputs final : public ReaderTest {
 public:
  using ReaderTest::ReaderTest;
  void TestBody() override {
    std::vector<Input> seeds;
    for (const char* kind : {"seeds", "found"})
      for (Case& one : cases_of(target_, kind)) seeds.push_back(std::move(one.bytes));
    ASSERT_FALSE(seeds.empty());
    const char* stated = std::getenv("TERRACAST_FUZZ_INPUTS");
    const std::size_t num_inputs = stated == nullptr ? kNumInputs : std::stoul(stated);
    Mutator mutator(seeds, 1);
    for (std::size_t i = 0; i < num_inputs && !HasFailure(); ++i)
      read(target_, mutator.next(), "made-" + std::to_string(i));
  }
};

template <class Kind>
void add_test(const Target& target, const char* name) {
  testing::RegisterTest(std::string(target.name).c_str(), name, nullptr, nullptr, __FILE__,
                        __LINE__, [&target]() -> ReaderTest* { return new Kind(target); });
}

}  // namespace
}  // namespace terracast::fuzz

int main(int argc, char** argv) {
  using namespace terracast::fuzz;
  testing::InitGoogleTest(&argc, argv);
  __sanitizer_set_death_callback(write_case);
  std::signal(SIGPROF, tell_of_time);
  if (!GTEST_FLAG_GET(list_tests)) prepare();
  for (const Target& target : targets()) {
    add_test<Seeds>(target, "SeedsAreRead");
    add_test<FoundCases>(target, "FoundCasesEndInOrder");
    add_test<MadeInputs>(target, "MadeInputsEndInOrder");
  }
  return RUN_ALL_TESTS();
}
