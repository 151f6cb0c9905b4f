#include "validate/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "validate/diagnosis.h"
#include "validate/report_page.h"

namespace terracast::validate {

namespace {

using core::Json;

std::string base64(std::span<const std::byte> bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::string figure(const CheckResult::Picture& picture) {
  return fmt::format(
      "<figure><img src=\"data:image/png;base64,{}\" width=\"{}\" height=\"{}\" "
      "alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
      base64(core::encode_png(picture.image, 6)), picture.image.width(), picture.image.height(),
      escaped(picture.title), escaped(picture.title));
}

/// Numbers as people read them: 0.0421, 12345, 3.2e-07.
std::string shown(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e7) return fmt::format("{:.0f}", value);
  return fmt::format("{:.4g}", value);
}

const char* state_of(bool is_ok, bool is_skipped) {
  return is_skipped ? "skip" : is_ok ? "ok" : "bad";
}

/// A row of the table of checks, from a check of report.json.
std::string row(const Json& check, const std::string& page) {
  const bool is_ok = check.at("ok").boolean();
  const bool is_skipped = check.at("skipped").boolean();
  const double value = check.at("value").number();
  const double bound = check.at("bound").number();
  const char* state = state_of(is_ok, is_skipped);
  const char* word = check.at("unseen").boolean() ? "not seen"
                     : is_skipped                 ? "not there"
                     : is_ok                      ? "right"
                                                  : "wrong";
  std::string bar;  // counts, whose bound is 0, have none
  if (!is_skipped && bound > 0.0) {
    const double share = share_of_bound(value, bound, check.at("lower_bound").boolean());
    bar = fmt::format("<span class=\"bar {}\"><span style=\"width:{:.0f}%\"></span></span>", state,
                      100.0 * std::min(share, 1.0));
  }
  const std::string& name = check.at("name").string();
  return fmt::format(
      "<tr class=\"{}\"><td><span class=\"dot {}\"></span>{}</td><td><a href=\"{}\">{}</a></td><td "
      "class=\"num\">{}</td>"
      "<td class=\"num\">{}</td><td>{}</td><td>{}</td><td class=\"worst\">{}</td></tr>\n",
      state, state, word, escaped(page + "#" + name), escaped(name),
      is_skipped ? "–" : shown(value), is_skipped ? "–" : shown(bound),
      escaped(check.at("unit").string()), bar, escaped(first_line(check.at("worst").string())));
}

constexpr const char* kTableHead =
    "<table><thead><tr><th></th><th>check</th><th class=\"num\">value</th><th "
    "class=\"num\">bound</th><th>unit</th>"
    "<th>of the bound</th><th>worst place</th></tr></thead><tbody>\n";

/// What a report.json says as a whole.
std::string verdict(const Json& report) {
  std::size_t num_right = 0, num_wrong = 0, num_absent = 0;
  const Json& checks = report.at("checks");
  const std::vector<std::string> unseen = report.at("unseen").strings();
  for (std::size_t i = 0; i < checks.size(); ++i)
    ++(!checks.at(i).at("ok").boolean()       ? num_wrong
       : checks.at(i).at("skipped").boolean() ? num_absent
                                              : num_right);
  num_absent -= unseen.size();
  const bool is_ok = report.at("ok").boolean();
  return fmt::format(
      "<div class=\"verdict {}\"><b>{}</b><span>{} right · {} wrong · {} not in the format · {} "
      "not "
      "seen{}</span></div>\n",
      state_of(is_ok, false), is_ok ? "Every bound holds" : "The dataset is wrong", num_right,
      num_wrong, num_absent, unseen.size(),
      escaped(fmt::format("{}{}", unseen.empty() ? "" : ": ", fmt::join(unseen, ", "))));
}

/// The map that `run` draws of world and paths, where a report's folder or the one above holds it.
std::string map_of(const std::filesystem::path& folder, const char* relative_path) {
  if (!std::filesystem::exists(folder / relative_path)) return "";
  return fmt::format(
      "<figure><a href=\"{0}\"><img src=\"{0}\" width=\"480\" alt=\"map\"></a><figcaption>The "
      "world and its paths</figcaption></figure>\n",
      relative_path);
}

std::string section(const CheckResult& result) {
  std::string html = fmt::format(
      "<section id=\"{}\" class=\"check\"><h3><span class=\"dot "
      "{}\"></span>{}<small>{}</small></h3>\n",
      escaped(result.name), state_of(result.ok, result.skipped), escaped(result.name),
      result.skipped ? ""
                     : escaped(fmt::format("{} against {} {}", shown(result.value),
                                           shown(result.bound), result.unit)));
  if (!result.summary.empty()) html += fmt::format("<p>{}</p>\n", escaped(result.summary));
  html += "<dl>";
  const auto item = [&](const char* term, const std::string& text) {
    if (!text.empty()) html += fmt::format("<dt>{}</dt><dd>{}</dd>", term, escaped(text));
  };
  item("bound", result.reason);
  item("finds", result.detects);
  item(result.skipped ? "why not" : "worst", result.worst);
  html += "</dl>\n<div class=\"figures\">\n";
  for (const CheckResult::Plot& plot : result.plots)
    if (plot.x.size() > 1) html += "<figure>" + svg_of(plot) + "</figure>\n";
  for (const CheckResult::Picture& picture : result.pictures) html += figure(picture);
  return html + "</div></section>\n";
}

}  // namespace

double share_of_bound(double value, double bound, bool is_lower_bound) {
  const double part = is_lower_bound ? bound : value;
  const double whole = is_lower_bound ? value : bound;
  if (!(part > 0.0)) return 0.0;
  return whole > 0.0 ? part / whole : std::numeric_limits<double>::infinity();
}

Json report_json(const std::vector<CheckResult>& results) {
  Json list = Json::array();
  Json unseen = Json::array();
  bool is_ok = !results.empty();
  for (const CheckResult& result : results) {
    is_ok = is_ok && result.ok;
    if (result.is_unseen) unseen.push(result.name);
    list.push(Json::object()
                  .set("name", result.name)
                  .set("value", std::isfinite(result.value) ? result.value : 1e300)
                  .set("bound", result.bound)
                  .set("lower_bound", result.is_lower_bound)
                  .set("unit", result.unit)
                  .set("ok", result.ok)
                  .set("worst", result.worst)
                  .set("skipped", result.skipped)
                  .set("unseen", result.is_unseen)
                  .set("summary", result.summary)
                  .set("reason", result.reason)
                  .set("detects", result.detects));
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
  return fmt::format(
      "{}{}{}{}", report.at("ok").boolean() ? "every bound holds" : "THE DATASET IS WRONG: ",
      fmt::join(wrong, ", "), unseen.empty() ? "" : "; not seen: ", fmt::join(unseen, ", "));
}

std::vector<std::string> cause_lines(const std::filesystem::path& report_folder) {
  const Json report = Json::read(report_folder / "report.json");
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < report.at("causes").size(); ++i)
    lines.push_back(report.at("causes").at(i).at("words").string());
  return lines;
}

void write_report(const ReportHead& head, const std::vector<CheckResult>& results,
                  const std::vector<CheckResult::Picture>& samples,
                  const std::filesystem::path& folder) {
  Json json = report_json(results);
  json.set("causes", causes_json(head.causes));
  json.write(folder / "report.json");
  std::string html = page_head(head.title);
  html += fmt::format("<header><p class=\"kind\">terracast validation</p><h1>{}</h1>",
                      escaped(head.title));
  for (const std::string& line : head.lines)
    html += fmt::format("<p class=\"about\">{}</p>", escaped(line));
  html +=
      "</header>\n" + verdict(json) + causes_html(json.at("causes")) + map_of(folder, "../map.png");
  html += "<h2>Checks</h2>\n" + std::string(kTableHead);
  for (std::size_t i = 0; i < results.size(); ++i) html += row(json.at("checks").at(i), "");
  html += "</tbody></table>\n";
  if (!samples.empty()) {
    html +=
        "<h2>Sample frames</h2>\n<p>First, middle and last frame of each camera; depth from near "
        "(yellow) to far (violet) on a "
        "logarithmic scale of each image, none (sky) in light blue.</p>\n<div class=\"figures\">\n";
    for (const CheckResult::Picture& picture : samples) html += figure(picture);
    html += "</div>\n";
  }
  html += "<h2>Each check</h2>\n";
  for (const CheckResult& result : results) html += section(result);
  html += page_end();
  core::write_file(folder / "index.html", html);
}

bool join_reports(const std::filesystem::path& folder, const std::vector<std::string>& formats) {
  Json list = Json::array();
  Json unseen = Json::array();
  Json causes = Json::array();
  bool is_ok = !formats.empty();
  std::string tables;
  for (const std::string& format : formats) {
    const Json report = Json::read(folder / format / "report.json");
    const bool is_format_ok = report.at("ok").boolean();
    const std::string page = format + "/index.html";
    is_ok = is_ok && is_format_ok;
    tables +=
        fmt::format("<h2><span class=\"dot {}\"></span><a href=\"{}\">{}</a></h2>\n{}",
                    state_of(is_format_ok, false), escaped(page), escaped(format), kTableHead);
    for (const std::string& name : report.at("unseen").strings()) unseen.push(format + "/" + name);
    for (std::size_t i = 0; i < report.at("causes").size(); ++i) {
      Json cause = report.at("causes").at(i);
      cause.set("words", format + ": " + cause.at("words").string());
      causes.push(cause);
    }
    const Json& checks = report.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i) {
      Json named = checks.at(i);
      named.set("name", format + "/" + checks.at(i).at("name").string());
      list.push(named);
      tables += row(checks.at(i), page);
    }
    tables += "</tbody></table>\n";
  }
  const Json joined = Json::object()
                          .set("ok", is_ok)
                          .set("unseen", unseen)
                          .set("checks", list)
                          .set("causes", causes);
  joined.write(folder / "report.json");
  std::string html = page_head("terracast validation");
  html += fmt::format("<header><p class=\"kind\">terracast validation</p><h1>{}</h1></header>\n",
                      escaped(fmt::format("{}", fmt::join(formats, ", "))));
  html += verdict(joined) + causes_html(causes) + map_of(folder, "map.png") + tables + page_end();
  core::write_file(folder / "index.html", html);
  return is_ok;
}

}  // namespace terracast::validate
