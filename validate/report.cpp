#include "validate/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
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
const char* word_of(bool is_ok, bool is_skipped) {
  return is_skipped ? "not seen" : is_ok ? "right" : "wrong";
}

/// How much of the bound is used, as a bar; empty for bounds from below and counts.
std::string bar_of(double value, double bound, bool is_ok, bool is_skipped) {
  if (is_skipped || bound <= 0.0 || (is_ok && value > bound)) return "";
  return fmt::format("<span class=\"bar {}\"><span style=\"width:{:.0f}%\"></span></span>",
                     state_of(is_ok, false), 100.0 * std::clamp(value / bound, 0.0, 1.0));
}

std::string row(const std::string& name, const std::string& link, double value, double bound,
                const std::string& unit, bool is_ok, bool is_skipped, const std::string& worst) {
  return fmt::format(
      "<tr class=\"{}\"><td><span class=\"dot {}\"></span>{}</td><td><a href=\"{}\">{}</a></td><td "
      "class=\"num\">{}</td>"
      "<td class=\"num\">{}</td><td>{}</td><td>{}</td><td class=\"worst\">{}</td></tr>\n",
      state_of(is_ok, is_skipped), state_of(is_ok, is_skipped), word_of(is_ok, is_skipped),
      escaped(link), escaped(name), is_skipped ? "–" : shown(value),
      is_skipped ? "–" : shown(bound), escaped(unit), bar_of(value, bound, is_ok, is_skipped),
      escaped(first_line(worst)));
}

constexpr const char* kTableHead =
    "<table><thead><tr><th></th><th>check</th><th class=\"num\">value</th><th "
    "class=\"num\">bound</th><th>unit</th>"
    "<th>of the bound</th><th>worst place</th></tr></thead><tbody>\n";

std::string verdict(bool is_ok, std::size_t num_right, std::size_t num_wrong,
                    std::size_t num_skipped) {
  return fmt::format(
      "<div class=\"verdict {}\"><b>{}</b><span>{} right · {} wrong · {} not seen or not in this "
      "format</span></div>\n",
      is_ok ? "ok" : "bad", is_ok ? "Every bound holds" : "The dataset is wrong", num_right,
      num_wrong, num_skipped);
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

struct Counts {
  std::size_t num_right = 0, num_wrong = 0, num_skipped = 0;
  void add(bool is_ok, bool is_skipped) {
    ++(is_skipped ? num_skipped : is_ok ? num_right : num_wrong);
  }
};

}  // namespace

Json report_json(const std::vector<CheckResult>& results) {
  Json list = Json::array();
  bool is_ok = !results.empty();
  for (const CheckResult& result : results) {
    is_ok = is_ok && result.ok;
    list.push(Json::object()
                  .set("name", result.name)
                  .set("value", std::isfinite(result.value) ? result.value : 1e300)
                  .set("bound", result.bound)
                  .set("unit", result.unit)
                  .set("ok", result.ok)
                  .set("worst", result.worst)
                  .set("skipped", result.skipped)
                  .set("summary", result.summary)
                  .set("reason", result.reason)
                  .set("detects", result.detects));
  }
  return Json::object().set("ok", is_ok).set("checks", list);
}

void write_report(const ReportHead& head, const std::vector<CheckResult>& results,
                  const std::vector<CheckResult::Picture>& samples,
                  const std::filesystem::path& folder) {
  const Json json = report_json(results);
  json.write(folder / "report.json");
  Counts counts;
  for (const CheckResult& result : results) counts.add(result.ok, result.skipped);
  std::string html = page_head(head.title);
  html += fmt::format("<header><p class=\"kind\">terracast validation</p><h1>{}</h1>",
                      escaped(head.title));
  for (const std::string& line : head.lines)
    html += fmt::format("<p class=\"about\">{}</p>", escaped(line));
  html += "</header>\n" +
          verdict(json.at("ok").boolean(), counts.num_right, counts.num_wrong, counts.num_skipped);
  html += "<h2>Checks</h2>\n" + std::string(kTableHead);
  for (const CheckResult& result : results)
    html += row(result.name, "#" + result.name, result.value, result.bound, result.unit, result.ok,
                result.skipped, result.worst);
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
  bool is_ok = !formats.empty();
  std::string tables;
  Counts counts;
  for (const std::string& format : formats) {
    const Json report = Json::read(folder / format / "report.json");
    const bool is_format_ok = report.at("ok").boolean();
    is_ok = is_ok && is_format_ok;
    tables +=
        fmt::format("<h2><span class=\"dot {}\"></span><a href=\"{}/index.html\">{}</a></h2>\n{}",
                    is_format_ok ? "ok" : "bad", escaped(format), escaped(format), kTableHead);
    const Json& results = report.at("checks");
    for (std::size_t i = 0; i < results.size(); ++i) {
      const Json& result = results.at(i);
      Json named = Json::object();
      for (const auto& [member, value] : result.members())
        named.set(member, member == "name" ? Json(format + "/" + value.string()) : value);
      list.push(named);
      const std::string& name = result.at("name").string();
      const bool is_skipped = result.has("skipped") && result.at("skipped").boolean();
      counts.add(result.at("ok").boolean(), is_skipped);
      tables += row(name, format + "/index.html#" + name, result.at("value").number(),
                    result.at("bound").number(), result.at("unit").string(),
                    result.at("ok").boolean(), is_skipped, result.at("worst").string());
    }
    tables += "</tbody></table>\n";
  }
  Json::object().set("ok", is_ok).set("checks", list).write(folder / "report.json");
  std::string html = page_head("terracast validation");
  html += fmt::format("<header><p class=\"kind\">terracast validation</p><h1>{}</h1></header>\n{}",
                      escaped(fmt::format("{}", fmt::join(formats, ", "))),
                      verdict(is_ok, counts.num_right, counts.num_wrong, counts.num_skipped));
  html += tables + page_end();
  core::write_file(folder / "index.html", html);
  return is_ok;
}

}  // namespace terracast::validate
