#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/error.h"

namespace terracast::test {

/// `work` throws an error of a kind, whose text has some words in it.
template <class Work>
void expect_error(core::ErrorKind kind, const std::vector<std::string>& words, Work&& work) {
  try {
    work();
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string& word : words) EXPECT_THAT(error.what(), testing::HasSubstr(word));
  }
}

}  // namespace terracast::test
