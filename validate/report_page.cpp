#include "validate/report_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/stage_cost.h"
#include "validate/check.h"

namespace terracast::validate {

namespace {

using core::Json;

/// Numbers as people read them: 0.0421, 12345, 3.2e-07.
std::string shown(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e7) return fmt::format("{:.0f}", value);
  return fmt::format("{:.4g}", value);
}

const char* state_of(bool is_ok, bool is_skipped) {
  return is_skipped ? "skip" : is_ok ? "ok" : "bad";
}
const char* state_of(const Json& check) {
  return state_of(check.at("ok").boolean(), check.at("skipped").boolean());
}
const char* word_of(const Json& check) {
  return check.at("unseen").boolean()    ? "not seen"
         : check.at("skipped").boolean() ? "not there"
         : check.at("ok").boolean()      ? "right"
                                         : "wrong";
}

/// A row of the table of checks, from a check of report.json.
std::string row(const Json& check, const std::string& page) {
  const bool is_skipped = check.at("skipped").boolean();
  const double value = check.at("value").number();
  const double bound = check.at("bound").number();
  const char* state = state_of(check);
  std::string bar;  // counts, whose bound is 0, have none
  if (!is_skipped && bound > 0.0) {
    const double share = share_of_bound(value, bound, check.at("lower_bound").boolean());
    bar = fmt::format("<span class=\"bar {}\"><span style=\"width:{:.0f}%\"></span></span>", state,
                      100.0 * std::min(share, 1.0));
  }
  const std::string& name = check.at("name").string();
  return fmt::format(
      "<tr class=\"{0}\" data-check=\"{1}\"><td><span class=\"dot {0}\"></span>{2}</td>"
      "<td><a href=\"{3}\">{1}</a></td><td class=\"num\">{4}</td><td class=\"num\">{5}</td>"
      "<td>{6}</td><td class=\"bars\">{7}</td><td class=\"worst\">{8}</td></tr>\n",
      state, escaped(name), word_of(check), escaped(page + "#check-" + name),
      is_skipped ? "–" : shown(value), is_skipped ? "–" : shown(bound),
      escaped(check.at("unit").string()), bar, escaped(first_line(check.at("worst").string())));
}

std::string table(const Json& checks, const std::string& page) {
  std::string html =
      "<div class=\"wide\"><table class=\"checks\"><thead><tr><th scope=\"col\">state</th>"
      "<th scope=\"col\">check</th><th scope=\"col\" class=\"num\">value</th>"
      "<th scope=\"col\" class=\"num\">bound</th><th scope=\"col\">unit</th>"
      "<th scope=\"col\" class=\"bars\">of the bound</th><th scope=\"col\">worst place</th></tr>"
      "</thead><tbody>\n";
  // What is wrong stands first.
  for (const bool is_wrong : {true, false})
    for (std::size_t i = 0; i < checks.size(); ++i)
      if (checks.at(i).at("ok").boolean() != is_wrong) html += row(checks.at(i), page);
  return html + "</tbody></table></div>\n";
}

struct Counts {
  std::size_t num_right = 0, num_wrong = 0, num_absent = 0, num_unseen = 0;
};
Counts counts_of(const Json& report) {
  Counts counts;
  const Json& checks = report.at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i)
    ++(checks.at(i).at("unseen").boolean()    ? counts.num_unseen
       : !checks.at(i).at("ok").boolean()     ? counts.num_wrong
       : checks.at(i).at("skipped").boolean() ? counts.num_absent
                                              : counts.num_right);
  return counts;
}

/// What a report.json says as a whole.
std::string verdict(const Json& report) {
  const Counts counts = counts_of(report);
  const bool is_ok = report.at("ok").boolean();
  return fmt::format(
             "<div class=\"verdict {}\" role=\"status\"><b>{}</b><span>{} right · {} wrong · {} "
             "not in "
             "the format · {} not seen</span></div>\n",
             state_of(is_ok, false), is_ok ? "Every bound holds" : "The dataset is wrong",
             counts.num_right, counts.num_wrong, counts.num_absent, counts.num_unseen) +
         (report.has("says")
              ? fmt::format("<p class=\"says\">{}</p>\n", escaped(report.at("says").string()))
              : "");
}

/// The causes that a report names (its member "causes": a list of objects with "words"), where it
/// has any.
std::string causes(const Json& report) {
  if (!report.has("causes") || report.at("causes").size() == 0) return "";
  std::string html = "<ul class=\"causes\">\n";
  for (std::size_t i = 0; i < report.at("causes").size(); ++i)
    html += fmt::format("<li>{}</li>\n", escaped(report.at("causes").at(i).at("words").string()));
  return html + "</ul>\n";
}

/// What the dataset states and no check proves.
std::string not_proved_table(const Json& report) {
  if (!report.has("not_proved") || report.at("not_proved").size() == 0) return "";
  std::string html =
      "<section id=\"not-proved\"><h2>Not proved</h2>\n<p>What the files state beside, and no "
      "check "
      "of this format proves.</p>\n<div class=\"wide\"><table><thead><tr><th scope=\"col\">files"
      "</th><th scope=\"col\" class=\"num\">how many</th><th scope=\"col\">fields</th>"
      "<th scope=\"col\">why</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < report.at("not_proved").size(); ++i) {
    const Json& one = report.at("not_proved").at(i);
    html += fmt::format("<tr><td>{}</td><td class=\"num\">{}</td><td>{}</td><td>{}</td></tr>\n",
                        escaped(one.at("files").string()), one.at("num_files").integer(),
                        escaped(one.at("fields").string()), escaped(one.at("why").string()));
  }
  return html + "</tbody></table></div></section>\n";
}

std::string head(std::string_view title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n"
      "<link rel=\"stylesheet\" href=\"page/page.css\">\n</head>\n<body>\n",
      escaped(title));
}

std::string header(std::string_view title, const std::vector<std::string>& lines) {
  std::string html =
      fmt::format("<header class=\"top\"><p class=\"kind\">terracast validation</p><h1>{}</h1>\n",
                  escaped(title));
  for (const std::string& line : lines)
    html += fmt::format("<p class=\"about\">{}</p>\n", escaped(line));
  return html + "</header>\n";
}

/// The words of a check; the page's script puts its plots and pictures behind them.
std::string section(const Json& check) {
  const std::string name = escaped(check.at("name").string());
  const bool is_skipped = check.at("skipped").boolean();
  // Some units say of themselves that the bound is a lower one.
  std::string unit = check.at("unit").string();
  if (const std::size_t said = unit.find("(at least)"); said != std::string::npos) unit.erase(said);
  std::string html = fmt::format(
      "<details class=\"check {0}\" id=\"check-{1}\"{2}><summary><span class=\"dot {0}\"></span>"
      "<b>{1}</b><span class=\"figure\">{3}</span></summary>\n<div class=\"body\">\n",
      state_of(check), name, check.at("ok").boolean() ? "" : " open",
      is_skipped ? std::string(word_of(check))
                 : escaped(fmt::format("{} of {} {} {}", shown(check.at("value").number()),
                                       check.at("lower_bound").boolean() ? "at least" : "at most",
                                       shown(check.at("bound").number()), unit)));
  if (!check.at("summary").string().empty())
    html += fmt::format("<p>{}</p>\n", escaped(check.at("summary").string()));
  html += "<dl>";
  const auto item = [&](const char* term, const std::string& text) {
    if (!text.empty()) html += fmt::format("<dt>{}</dt><dd>{}</dd>", term, escaped(text));
  };
  item("why this bound", check.at("reason").string());
  item("finds", check.at("detects").string());
  if (check.has("probability"))
    item("in a right dataset", fmt::format("a value as far off has a probability of {:.2g}",
                                           check.at("probability").number()));
  if (check.has("smallest"))
    item("smallest error that would have shown",
         fmt::format("{} {}", shown(check.at("smallest").number()), unit));
  else if (!is_skipped && check.at("bound").number() == 0.0)
    item("smallest error that would have shown", "a single one");
  item(is_skipped ? "why not" : "worst", check.at("worst").string());
  if (check.has("unseen_parts"))
    item("would not have shown it",
         fmt::format("{}", fmt::join(check.at("unseen_parts").strings(), ", ")));
  return html + "</dl>\n<div class=\"figures\"></div>\n</div></details>\n";
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\n':
        result += "<br>";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string first_line(std::string_view text) {
  const std::size_t end = text.find('\n');
  return std::string(text.substr(0, end)) + (end == std::string_view::npos ? "" : " …");
}

std::string dataset_page(const std::string& title, const std::vector<std::string>& lines,
                         const Json& report) {
  const Json& checks = report.at("checks");
  std::string html =
      head(title) + header(title, lines) +
      "<nav class=\"jump\" aria-label=\"Parts of the page\" hidden></nav>\n<main>\n" +
      verdict(report) + causes(report);
  html += "<section id=\"checks\"><h2>Checks</h2>\n" + table(checks, "") + "</section>\n";
  html +=
      "<div id=\"parts\"></div>\n<noscript><p class=\"note\">Map, images, cloud and plots need "
      "scripts, which this page carries with it.</p></noscript>\n";
  html += "<section id=\"each\"><h2>Each check</h2>\n";
  for (std::size_t i = 0; i < checks.size(); ++i) html += section(checks.at(i));
  return html + "</section>\n" + not_proved_table(report) +
         "</main>\n<footer id=\"foot\"></footer>\n<script "
         "src=\"page/page.js\"></script>\n"
         "<script src=\"page/data.js\"></script>\n</body></html>\n";
}

std::string start_page(const std::vector<JoinedFormat>& formats, const Json& joined,
                       const Json& stages, bool has_map) {
  std::vector<std::string> names;
  for (const JoinedFormat& format : formats) names.push_back(format.name);
  std::string html =
      head("terracast validation") +
      header(fmt::format("{}", fmt::join(names, ", ")),
             {"Each format was read back from its files alone and judged by itself."}) +
      "<main>\n" + verdict(joined) + causes(joined);
  html += "<section id=\"formats\"><h2>Formats</h2>\n<div class=\"cards\">\n";
  for (const JoinedFormat& format : formats) {
    const Counts counts = counts_of(format.report);
    const bool is_ok = format.report.at("ok").boolean();
    const std::string page = escaped(format.name + "/index.html");
    html += fmt::format(
        "<a class=\"card {0}\" href=\"{1}\">{2}<span class=\"words\"><b><span class=\"dot {0}\">"
        "</span>{3}</b><span>{4}</span><span class=\"soft\">{5} right · {6} wrong · {7} not in the "
        "format · {8} not seen</span></span></a>\n",
        state_of(is_ok, false), page,
        format.picture.empty()
            ? std::string()
            : fmt::format("<img src=\"{}\" alt=\"one of its images\" loading=\"lazy\">",
                          escaped(format.picture)),
        escaped(format.name), is_ok ? "every bound holds" : "the dataset is wrong",
        counts.num_right, counts.num_wrong, counts.num_absent, counts.num_unseen);
  }
  html += "</div></section>\n";
  if (has_map)
    html +=
        "<section id=\"map\"><h2>The world and its paths</h2>\n<a href=\"map.png\"><img "
        "class=\"map\" src=\"map.png\" alt=\"map of the world and the paths of its sequences\">"
        "</a></section>\n";
  if (stages.size() > 0) {
    html +=
        "<section id=\"costs\"><h2>What the run cost</h2>\n<div class=\"wide\"><table><thead><tr>"
        "<th scope=\"col\">stage</th><th scope=\"col\" class=\"num\">time</th><th scope=\"col\" "
        "class=\"num\">of CPU</th><th scope=\"col\" class=\"num\">memory of the process so far, "
        "MiB</th></tr></thead><tbody>\n";
    for (std::size_t i = 0; i < stages.size(); ++i)
      html += fmt::format(
          "<tr><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td><td "
          "class=\"num\">{:.0f}"
          "</td></tr>\n",
          escaped(stages.at(i).at("stage").string()),
          core::duration_text(stages.at(i).at("wall_s").number()),
          core::duration_text(stages.at(i).at("cpu_s").number()),
          stages.at(i).at("peak_bytes").number() / 1048576.0);
    html += "</tbody></table></div></section>\n";
  }
  for (const JoinedFormat& format : formats)
    html += fmt::format("<section><h2><a href=\"{0}/index.html\">{0}</a></h2>\n{1}</section>\n",
                        escaped(format.name),
                        table(format.report.at("checks"), format.name + "/index.html"));
  return html + "</main>\n</body></html>\n";
}

}  // namespace terracast::validate
