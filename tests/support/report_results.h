#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/json.h"

namespace terracast::test {

/// The entry of a result in a report.json; a failure where it has none.
inline core::Json result_of(const core::Json& report, const std::string& name) {
  for (std::size_t i = 0; i < report.at("checks").size(); ++i)
    if (report.at("checks").at(i).at("name").string() == name) return report.at("checks").at(i);
  ADD_FAILURE() << "no result " << name;
  return core::Json::object();
}

/// The same of the report in a folder.
inline core::Json result_in(const std::filesystem::path& report_folder, const std::string& name) {
  return result_of(core::Json::read(report_folder / "report.json"), name);
}

}  // namespace terracast::test
