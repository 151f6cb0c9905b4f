#include "batch/dataset/ground_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::batch {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr double kBandsPerDegree = kGroundBands / 180.0;
constexpr double kCellsOfEquator = 400750.0;

std::vector<std::int32_t> count_cells() {
  std::vector<std::int32_t> counts(kGroundBands);
  for (int band = 0; band < kGroundBands; ++band) {
    const double middle_deg = (band + 0.5) / kBandsPerDegree - 90.0;
    const double count = kCellsOfEquator * std::cos(geo::radians_from_degrees(middle_deg));
    counts[static_cast<std::size_t>(band)] =
        std::max(1, static_cast<std::int32_t>(std::lround(count)));
  }
  return counts;
}

}  // namespace

int cells_in_band(int band) {
  static const std::vector<std::int32_t> counts = count_cells();
  return counts[static_cast<std::size_t>(band)];
}

int band_at(double lat_deg) {
  return std::clamp(static_cast<int>(std::floor((lat_deg + 90.0) * kBandsPerDegree)), 0,
                    kGroundBands - 1);
}

int column_at(int band, double lon_deg) {
  const int count = cells_in_band(band);
  const double turns = (lon_deg + 180.0) / 360.0;
  return std::min(static_cast<int>((turns - std::floor(turns)) * count), count - 1);
}

GroundCell ground_cell_at(double lat_deg, double lon_deg) {
  const int band = band_at(lat_deg);
  return {band, column_at(band, lon_deg)};
}

CellBounds bounds_of(const GroundCell& cell) {
  const double width_deg = 360.0 / cells_in_band(cell.band);
  return {cell.band / kBandsPerDegree - 90.0, (cell.band + 1) / kBandsPerDegree - 90.0,
          cell.column * width_deg - 180.0, (cell.column + 1) * width_deg - 180.0};
}

void join_runs(std::vector<CellRun>& runs) {
  if (runs.empty()) return;
  std::sort(runs.begin(), runs.end());
  std::size_t last = 0;
  for (std::size_t i = 1; i < runs.size(); ++i) {
    CellRun& joined = runs[last];
    const std::int32_t end = joined.first_column + joined.num_cells;
    if (runs[i].band == joined.band && runs[i].first_column <= end)
      joined.num_cells =
          std::max(end, runs[i].first_column + runs[i].num_cells) - joined.first_column;
    else
      runs[++last] = runs[i];
  }
  runs.resize(last + 1);
}

std::int64_t GroundSeen::num_cells() const {
  std::int64_t sum = 0;
  for (const CellRun& run : runs) sum += run.num_cells;
  return sum;
}

bool GroundSeen::holds(const GroundCell& cell) const {
  const CellRun beyond{cell.band, cell.column, std::numeric_limits<std::int32_t>::max()};
  const auto after = std::upper_bound(runs.begin(), runs.end(), beyond);
  if (after == runs.begin()) return false;
  const CellRun& run = *std::prev(after);
  return run.band == cell.band && cell.column < run.first_column + run.num_cells;
}

Json json_from_ground(const GroundSeen& seen) {
  Json bands = Json::array();
  for (std::size_t i = 0; i < seen.runs.size();) {
    const std::int32_t band = seen.runs[i].band;
    Json row = Json::array().push(band);
    for (; i < seen.runs.size() && seen.runs[i].band == band; ++i)
      row.push(seen.runs[i].first_column).push(seen.runs[i].num_cells);
    bands.push(std::move(row));
  }
  return Json::object()
      .set("ground", seen.ground)
      .set("within_m", std::isfinite(seen.within_m) ? Json(seen.within_m) : Json())
      .set("cells", seen.num_cells())
      .set("bands", std::move(bands));
}

GroundSeen ground_from_json(const Json& json, const std::string& file) {
  GroundSeen seen;
  seen.ground = json.at("ground").string();
  const Json& within = json.at("within_m");
  seen.within_m = within.is_null() ? std::numeric_limits<double>::infinity() : within.number();
  if (!(seen.within_m > 0.0)) fail(ErrorKind::Input, "{}: within_m = {}", file, seen.within_m);
  const Json& bands = json.at("bands");
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const Json& row = bands.at(i);
    const std::int64_t band = row.at(std::size_t{0}).integer();
    const std::int64_t before =
        seen.runs.empty() ? -1 : static_cast<std::int64_t>(seen.runs.back().band);
    if (band <= before || band >= kGroundBands || row.size() < 3 || row.size() % 2 == 0)
      fail(ErrorKind::Input, "{}: bands[{}] is not a band in ascending order with its runs", file,
           i);
    std::int64_t end = -1;  // runs that touch would be one
    for (std::size_t k = 1; k < row.size(); k += 2) {
      const std::int64_t first = row.at(k).integer();
      const std::int64_t count = row.at(k + 1).integer();
      const std::int64_t most = cells_in_band(static_cast<int>(band));
      if (first <= end || count < 1 || first > most || count > most - first)
        fail(ErrorKind::Input, "{}: bands[{}]: {} cells from {} on cannot be; the band has {}",
             file, i, count, first, most);
      seen.runs.push_back({static_cast<std::int32_t>(band), static_cast<std::int32_t>(first),
                           static_cast<std::int32_t>(count)});
      end = first + count;
    }
  }
  if (json.at("cells").integer() != seen.num_cells())
    fail(ErrorKind::Input, "{}: cells = {}, but its bands hold {}", file,
         json.at("cells").integer(), seen.num_cells());
  return seen;
}

}  // namespace terracast::batch
