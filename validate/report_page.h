#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/json.h"

/// The HTML of the report's pages. What stands in it can be read without scripts: verdict, table,
/// words of each check; `page/page.js` adds the rest.
namespace terracast::validate {

/// Text as it may stand in HTML and in attributes; line ends become <br>.
std::string escaped(std::string_view text);
std::string first_line(std::string_view text);

/// The page of one dataset.
/// title   "kitti: demo"; lines: what was validated
/// report  report.json
std::string dataset_page(const std::string& title, const std::vector<std::string>& lines,
                         const core::Json& report);

/// One format of a joined report.
struct JoinedFormat {
  std::string name;
  core::Json report;    ///< its report.json
  std::string picture;  ///< path of one of its images from the joined page; empty: none
};
/// The page that leads to each format's.
/// joined   the joined report.json
/// stages   what the run cost: stage_costs()
/// has_map  a map.png lies beside the page
std::string start_page(const std::vector<JoinedFormat>& formats, const core::Json& joined,
                       const core::Json& stages, bool has_map);

}  // namespace terracast::validate
