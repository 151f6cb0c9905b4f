#include "cli/sources_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/ledger.h"
#include "geo/fixes/fix_format.h"
#include "rigs/rig_format.h"
#include "tiler/gdal_formats.h"
#include "tiler/known_tags.h"
#include "tiler/objects/model_file.h"
#include "tiler/raster_ledger.h"

namespace terracast::cli {

namespace {

using core::KnownName;
using core::KnownTable;

struct Chapter {
  const char* title;
  std::string words;
  std::vector<KnownTable> tables;
};

std::vector<KnownTable> tables_of_recordings() {
  std::vector<KnownTable> tables;
  for (const geo::FixFormatInfo& format : geo::fix_formats())
    tables.insert(tables.end(), format.known.begin(), format.known.end());
  return tables;
}

/// Which of GDAL's formats are read, and where.
std::string formats_text(const char* const* all, const char* const* trodden) {
  std::vector<std::string_view> here;
  for (; *trodden != nullptr; ++trodden) here.emplace_back(*trodden);
  std::vector<std::string_view> apart;
  for (; *all != nullptr; ++all)
    if (std::find(here.begin(), here.end(), *all) == here.end()) apart.emplace_back(*all);
  return fmt::format(
      "\n\nGDAL's formats {} are read by the program's own process, and {} by a process of its own "
      "([where files can do no harm](tiler.md)).",
      fmt::join(here, ", "), fmt::join(apart, ", "));
}

std::vector<Chapter> chapters() {
  return {
      {"Vector features",
       "Layers of buildings, roads, water and objects read any file of OGR's, and go by "
       "OpenStreetMap's "
       "tags. [docs/tiler.md](tiler.md) says how a tag is understood." +
           formats_text(tiler::kVectorFormats, tiler::kTroddenVectors),
       tiler::known_tag_tables()},
      {"Rasters",
       "Heights, imagery, land cover and canopies read any raster of GDAL's. "
       "[docs/tiler.md](tiler.md) says what counts as a height." +
           formats_text(tiler::kRasterFormats, tiler::kTroddenRasters),
       tiler::raster_tables()},
      {"Models", "Things that are placed as models: glTF 2, OBJ and PLY. [docs/tiler.md](tiler.md)",
       tiler::model_tables()},
      {"Calibrations", "What `terracast rig import` reads. [docs/rigs.md](rigs.md)",
       rigs::known_names_of_rigs()},
      {"Recordings", "Flights that were recorded. [docs/frames.md](frames.md)",
       tables_of_recordings()}};
}

/// A cell of Markdown keeps its bars.
std::string cell(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '|') result += '\\';
    result += c;
  }
  return result;
}

constexpr const char* kHead = "| name | | what for, or why not |\n| --- | --- | --- |\n";

std::string row_of(const KnownName& name) {
  return fmt::format("| `{}` | {} | {} |\n", cell(name.name), name.is_used ? "used" : "ignored",
                     cell(name.words));
}

bool has_row(const KnownTable& table, const std::string& row) {
  return std::any_of(table.names.begin(), table.names.end(),
                     [&](const KnownName& name) { return row_of(name) == row; });
}

/// Rows that all of several tables have stand once, behind the others.
std::string text_of(const std::vector<KnownTable>& tables) {
  std::string text, of_all;
  std::set<std::string> common;
  if (tables.size() > 1)
    for (const KnownName& name : tables.front().names)
      if (const std::string row = row_of(name);
          std::all_of(tables.begin(), tables.end(),
                      [&](const KnownTable& table) { return has_row(table, row); }) &&
          common.insert(row).second)
        of_all += row;
  for (const KnownTable& table : tables) {
    std::string rows;
    std::set<std::string_view> names;  // of two of one name the first is gone by
    for (const KnownName& name : table.names)
      if (!common.contains(row_of(name)) && names.insert(name.name).second) rows += row_of(name);
    if (!rows.empty())
      text += fmt::format("\n### {}: {}\n\n{}{}", table.reader, table.what, kHead, rows);
  }
  if (!of_all.empty()) text += fmt::format("\n### all of these\n\n{}{}", kHead, of_all);
  return text;
}

}  // namespace

std::string sources_page() {
  std::string text =
      "# What files from outside say\n\n"
      "Written by `terracast docs sources`, from the tables that the readers go by.\n\n"
      "Whatever a reader meets in a file is *used*, *ignored* for a reason that stands here, or "
      "*unknown*: counted by "
      "name in the\nledger of its source. Values of a used name that cannot be understood are "
      "counted too, and taken as "
      "if the name were not\nthere. `terracast world info WORLD --ledger` and `terracast rig "
      "import FILE --ledger` show "
      "the ledger; what is unknown is\nreported at the end of tiling, and when a rig or a recording is "
      "read. A star "
      "stands for any letters.\n";
  for (const Chapter& chapter : chapters()) {
    text += fmt::format("\n## {}\n\n{}\n", chapter.title, chapter.words);
    text += text_of(chapter.tables);
  }
  return text;
}

}  // namespace terracast::cli
