#pragma once

#include <gtest/gtest.h>

#include <filesystem>

namespace terracast::test {

/// COLMAP, where Debian's package puts it.
constexpr const char* kColmap = "/usr/bin/colmap";

}  // namespace terracast::test

/// Skips the test, saying so, where COLMAP is not installed.
#define TERRACAST_NEEDS_COLMAP()                            \
  if (!std::filesystem::exists(::terracast::test::kColmap)) \
  GTEST_SKIP() << "skipped: the package colmap is not installed (scripts/install test)"
