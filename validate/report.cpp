#include "validate/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/plugin_rows.h"
#include "validate/diagnosis.h"
#include "validate/head_sentence.h"
#include "validate/not_proved.h"
#include "validate/page_bundle.h"
#include "validate/place.h"
#include "validate/report_page.h"

namespace terracast::validate {

namespace {

using core::Json;

/// Where a result's worst value stands, as names and as the numbers of the page's lists.
Json place_json(const Place& place, const Dataset& dataset) {
  const Sequence& sequence = dataset.sequences[static_cast<std::size_t>(place.sequence)];
  Json json = Json::object()
                  .set("sequence", sequence.name)
                  .set("camera", sequence.cameras[static_cast<std::size_t>(place.camera)].name)
                  .set("frame", place.frame);
  if (place.pixel) json.set("pixel", Json::array().push(place.pixel->x()).push(place.pixel->y()));
  return json;
}

/// One of the images that a format's page shows: the middle one.
std::string picture_of(const std::filesystem::path& folder, const std::string& format) {
  std::vector<std::string> pictures;
  for (const std::string& name : list_folder(folder / format / "page/images"))
    if (name.ends_with(".png")) pictures.push_back(name);
  if (pictures.empty()) return "";
  return format + "/page/images/" + pictures[pictures.size() / 2];
}

/// The smallest error that would have shown: where a check did not find it out by its scatter, one that takes all that
/// the value and the bound leave, whichever way the value would have gone.
/// returns  nothing beside a bound of 0, where any would, and where nothing was measured or something is wrong
std::optional<double> smallest_of(const CheckResult& result) {
  if (result.smallest) return result.smallest;
  if (result.skipped || !result.ok || result.probability || result.bound == 0.0)
    return std::nullopt;
  return result.is_lower_bound ? result.value - result.bound : result.value + result.bound;
}

}  // namespace

double share_of_bound(double value, double bound, bool is_lower_bound) {
  const double part = is_lower_bound ? bound : value;
  const double whole = is_lower_bound ? value : bound;
  if (!(part > 0.0)) return 0.0;
  return whole > 0.0 ? part / whole : std::numeric_limits<double>::infinity();
}

Json report_json(const std::vector<CheckResult>& results, const Dataset* dataset) {
  Json list = Json::array();
  Json unseen = Json::array();
  bool is_ok = !results.empty();
  for (const CheckResult& result : results) {
    is_ok = is_ok && result.ok;
    if (result.is_unseen) unseen.push(result.name);
    Json check = Json::object()
                     .set("name", result.name)
                     .set("value", std::isfinite(result.value) ? result.value : 1e300)
                     .set("bound", std::isfinite(result.bound) ? result.bound : 1e300)
                     .set("lower_bound", result.is_lower_bound)
                     .set("unit", result.unit)
                     .set("ok", result.ok)
                     .set("worst", result.worst)
                     .set("skipped", result.skipped)
                     .set("unseen", result.is_unseen)
                     .set("summary", result.summary)
                     .set("reason", result.reason)
                     .set("detects", result.detects);
    if (result.probability) check.set("probability", *result.probability);
    if (const std::optional<double> smallest = smallest_of(result);
        smallest && std::isfinite(*smallest))
      check.set("smallest", *smallest);
    if (!result.unseen_parts.empty())
      check.set("unseen_parts", Json::array_of(result.unseen_parts));
    if (dataset != nullptr)
      if (const std::optional<Place> place = place_in(result.worst, *dataset))
        check.set("place", place_json(*place, *dataset));
    list.push(check);
  }
  return Json::object().set("ok", is_ok).set("unseen", unseen).set("checks", list);
}

std::string verdict_line(const std::filesystem::path& report_folder) {
  const Json report = Json::read(report_folder / "report.json");
  const Json& checks = report.at("checks");
  std::vector<std::string> wrong;
  for (std::size_t i = 0; i < checks.size(); ++i)
    if (!checks.at(i).at("ok").boolean()) wrong.push_back(checks.at(i).at("name").string());
  const std::vector<std::string> unseen = report.at("unseen").strings();
  return fmt::format("{}{}{}{}",
                     report.at("ok").boolean() ? "every bound holds" : "THE DATASET IS WRONG: ",
                     by_check(wrong), unseen.empty() ? "" : "; not seen: ", by_check(unseen));
}

std::vector<std::string> cause_lines(const std::filesystem::path& report_folder) {
  const Json report = Json::read(report_folder / "report.json");
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < report.at("causes").size(); ++i)
    lines.push_back(report.at("causes").at(i).at("words").string());
  return lines;
}

void write_report(const ReportHead& head, const std::vector<CheckResult>& results,
                  const PageSource& source, const std::filesystem::path& folder) {
  Json report = report_json(results, source.dataset);
  report.set("causes", causes_json(head.causes));
  if (source.dataset != nullptr)
    report.set("not_proved", not_proved_json(not_proved(*source.dataset)));
  if (Json plugins = core::plugin_record(names_of_checks()); plugins.size() > 0)
    report.set("plugins", std::move(plugins));
  report.set("says", head_sentence(report));
  report.write(folder / "report.json");
  write_page_data(head.title, results, report, source, folder);
  core::write_file(folder / "index.html", dataset_page(head.title, head.lines, report));
}

bool join_reports(const std::filesystem::path& folder, const std::vector<std::string>& formats,
                  const std::filesystem::path& events_file) {
  Json list = Json::array();
  Json unseen = Json::array();
  Json causes = Json::array();
  Json not_proved = Json::array();
  bool is_ok = !formats.empty();
  std::vector<JoinedFormat> parts;
  for (const std::string& format : formats) {
    const Json report = Json::read(folder / format / "report.json");
    is_ok = is_ok && report.at("ok").boolean();
    for (const std::string& name : report.at("unseen").strings()) unseen.push(format + "/" + name);
    for (std::size_t i = 0; i < report.at("causes").size(); ++i) {
      Json cause = report.at("causes").at(i);
      cause.set("words", format + ": " + cause.at("words").string());
      causes.push(cause);
    }
    for (std::size_t i = 0; report.has("not_proved") && i < report.at("not_proved").size(); ++i) {
      Json one = report.at("not_proved").at(i);
      one.set("files", format + "/" + one.at("files").string());
      not_proved.push(std::move(one));
    }
    const Json& checks = report.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i) {
      Json named = checks.at(i);
      named.set("name", format + "/" + checks.at(i).at("name").string());
      list.push(named);
    }
    parts.push_back({format, report, picture_of(folder, format)});
  }
  Json joined = Json::object()
                    .set("ok", is_ok)
                    .set("unseen", unseen)
                    .set("checks", list)
                    .set("causes", causes)
                    .set("not_proved", not_proved);
  joined.set("says", head_sentence(joined));
  joined.write(folder / "report.json");
  core::write_file(folder / "page/page.css", page_style());
  core::write_file(folder / "index.html", start_page(parts, joined, stage_costs(events_file),
                                                     std::filesystem::exists(folder / "map.png")));
  return is_ok;
}

}  // namespace terracast::validate
