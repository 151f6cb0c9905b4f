#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::test {

/// A format of recordings with the keys of a config.
std::unique_ptr<geo::FixFormat> format_from(const std::string& name, const std::string& toml);

/// Recordings as texts.
class Recordings : public testing::Test {
 protected:
  std::filesystem::path written(const std::string& name, const std::string& text);
  geo::FixTable read(const std::string& format, const std::string& toml, const std::string& text,
                     const std::string& above = "ellipsoid");
  std::string refused(const std::string& format, const std::string& toml, const std::string& text,
                      core::ErrorKind kind = core::ErrorKind::Input,
                      const std::string& above = "ellipsoid");

  ScratchFolder scratch_;
};

/// All that a reader remarks, a line each.
std::string remarks_of(const geo::FixTable& table);

}  // namespace terracast::test
