#include "tests/support/made_once.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/atomic_file.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

/// A folder of made_once with a name of this test and process alone.
class MadeOnce : public testing::Test {
 protected:
  void TearDown() override {
    for (const char* ending : {"", ".lock", ".files", ".key"})
      fs::remove_all(fs::path(TERRACAST_MADE_ONCE) / (name_ + ending));
  }
  fs::path make(const std::string& inputs) {
    return made_once(name_, inputs, [&](const fs::path& folder) {
      ++num_made_;
      write_text(folder / "part" / "text", inputs);
    });
  }
  const std::string name_ = fmt::format("made_once_test_{}", ::getpid());
  int num_made_ = 0;
};

TEST_F(MadeOnce, IsMadeForTheFirstThatAsksAndAnewForOtherInputs) {
  const fs::path folder = make("a");
  EXPECT_EQ(make("a"), folder);
  EXPECT_EQ(num_made_, 1);
  make("b");
  EXPECT_EQ(num_made_, 2);
  EXPECT_EQ(core::read_text_file(folder / "part/text"), "b");
}

TEST_F(MadeOnce, IsMadeOnceForThreadsThatAskAtTheSameTime) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&] { make("a"); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_made_, 1);
}

TEST_F(MadeOnce, AFolderThatATestHasChangedIsNamedAndMadeAnew) {
  const auto message_after = [&](const auto& change) -> std::string {
    change(make("a"));
    try {
      make("a");
    } catch (const std::logic_error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message_after([](const fs::path& folder) {
              write_text(folder / "part/text", "longer than before");
            }).find("part/text"),
            std::string::npos);
  EXPECT_NE(
      message_after([](const fs::path& folder) { write_text(folder / "more", ""); }).find("more"),
      std::string::npos);
  EXPECT_NE(message_after([](const fs::path& folder) {
              fs::remove(folder / "part/text");
            }).find("part/text"),
            std::string::npos);
  EXPECT_EQ(num_made_, 3);
}

TEST_F(MadeOnce, WhatCouldNotBeMadeIsNotKept) {
  const auto fails = [](const fs::path&) { throw std::runtime_error("no"); };
  EXPECT_THROW(made_once(name_, "a", fails), std::runtime_error);
  make("a");
  EXPECT_EQ(num_made_, 1);
}

}  // namespace
}  // namespace terracast::test
