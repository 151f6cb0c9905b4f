#include "tiler/file_memo.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using tiler::FileMemo;

void write_old(const std::filesystem::path& file, const std::string& text, int age_s) {
  std::ofstream(file) << text;
  std::filesystem::last_write_time(
      file, std::filesystem::file_time_type::clock::now() - std::chrono::seconds(age_s));
}

struct Sizes {
  int operator()(const std::filesystem::path& file) {
    return memo.of(file.string(), [&] {
      ++num_found;
      return static_cast<int>(std::filesystem::file_size(file));
    });
  }
  FileMemo<int> memo;
  int num_found = 0;
};

TEST(FileMemo, FindsOnceInAFileThatStaysAsItIs) {
  const ScratchFolder folder;
  Sizes sizes;
  write_old(folder / "a", "1234", 100);
  write_old(folder / "b", "12", 100);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(sizes(folder / "a"), 4);
    EXPECT_EQ(sizes(folder / "b"), 2);
  }
  EXPECT_EQ(sizes.num_found, 2);
}

TEST(FileMemo, FindsAgainInAFileThatWasChangedOrReplaced) {
  const ScratchFolder folder;
  Sizes sizes;
  write_old(folder / "a", "1234", 100);
  EXPECT_EQ(sizes(folder / "a"), 4);
  write_old(folder / "a", "123456", 100);  // another size
  EXPECT_EQ(sizes(folder / "a"), 6);
  const auto time = std::filesystem::last_write_time(folder / "a");
  // The same size and time, but another file.
  write_old(folder / "b", "abcdef", 100);
  std::filesystem::last_write_time(folder / "b", time);
  std::filesystem::rename(folder / "b", folder / "a");
  EXPECT_EQ(sizes(folder / "a"), 6);
  std::filesystem::last_write_time(folder / "a", time + std::chrono::nanoseconds(1000));
  EXPECT_EQ(sizes(folder / "a"), 6);
  EXPECT_EQ(sizes.num_found, 4);
}

// A file that was just written may be written again before the file system's clock moves on.
TEST(FileMemo, KeepsNothingOfWhatWasJustWrittenIsNoFileOrFailed) {
  const ScratchFolder folder;
  Sizes sizes;
  std::ofstream(folder / "new") << "1";
  sizes(folder / "new");
  sizes(folder / "new");
  EXPECT_EQ(sizes.num_found, 2);
  for (const std::string& name : {std::string("/vsizip/a.zip/b"), folder.path().string()}) {
    int num = 0;
    for (int i = 0; i < 2; ++i) sizes.memo.of(name, [&] { return ++num; });
    EXPECT_EQ(num, 2) << name;
  }
  write_old(folder / "old", "12", 100);
  const std::string old = (folder / "old").string();
  EXPECT_THROW(sizes.memo.of(old, []() -> int { throw std::runtime_error("unreadable"); }),
               std::runtime_error);
  EXPECT_EQ(sizes.memo.of(old, [] { return 5; }), 5);
}

}  // namespace
}  // namespace terracast::test
