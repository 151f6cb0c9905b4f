#include "validate/head_sentence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string_view>
#include <vector>

namespace terracast::validate {

namespace {

using core::Json;

/// What checks whose names begin so are about. The first that fits counts.
struct Subject {
  std::string_view prefix;
  std::string_view words;
};
constexpr std::array kSubjects{
    Subject{"structure", "the files' presence and form"},
    Subject{"reprojection", "depth, poses and intrinsics"},
    Subject{"stereo", "depth, poses and intrinsics"},
    Subject{"depth", "depth, poses and intrinsics"},
    Subject{"bounds", "the stated bounds of depth and flow"},
    Subject{"flow", "flow and its masks"},
    Subject{"photometric", "images against the geometry"},
    Subject{"colors", "images by themselves"},
    Subject{"georeference", "places on Earth and times"},
    Subject{"georegistration", "places on Earth and times"},
    Subject{"clocks", "clocks"},
    Subject{"trajectory", "the trajectory's form"},
    Subject{"calibration", "calibration files"},
    Subject{"rays", "tables of rays"},
    Subject{"segmentation", "classes"},
    Subject{"oracle", "truth against the world itself"},
    Subject{"motion", "velocities and turn rates"},
    Subject{"oxts", "inertial packets"},
    Subject{"inertial", "inertial units"},
    Subject{"navigation", "fixes, pressures and magnetic fields"},
    Subject{"moving", "what moves"},
    Subject{"sensor", "samples of other sensors"},
    Subject{"colmap_sparse", "what COLMAP triangulates"},
    Subject{"colmap_free", "what COLMAP reconstructs"},
    Subject{"colmap_georegister", "what COLMAP georegisters"},
    Subject{"colmap", "COLMAP's model"},
};

/// "kitti/flow" is check "flow" of format "kitti"; one of a single format has none.
struct CheckName {
  std::string_view format, check;
};
CheckName parted(std::string_view name) {
  const std::size_t slash = name.rfind('/');
  if (slash == std::string_view::npos) return {"", name};
  return {name.substr(0, slash), name.substr(slash + 1)};
}

/// returns  the check's own name where no subject is known
std::string_view subject_of(std::string_view name) {
  const std::string_view check = parted(name).check;
  for (const Subject& subject : kSubjects)
    if (check.starts_with(subject.prefix)) return subject.words;
  return check;
}

/// Words in the order in which they come, each once.
class Words {
 public:
  void add(std::string_view word) {
    if (std::find(words_.begin(), words_.end(), word) == words_.end()) words_.emplace_back(word);
  }
  void remove(const Words& others) {
    std::erase_if(words_, [&](const std::string& word) {
      return std::find(others.words_.begin(), others.words_.end(), word) != others.words_.end();
    });
  }
  bool empty() const { return words_.empty(); }
  /// "a", "a and b", "a, b and c".
  std::string text() const {
    std::string text;
    for (std::size_t i = 0; i < words_.size(); ++i)
      text += fmt::format("{}{}", i == 0 ? "" : i + 1 == words_.size() ? " and " : ", ", words_[i]);
    return text;
  }

 private:
  std::vector<std::string> words_;
};

}  // namespace

std::string head_sentence(const Json& report) {
  Words wrong, proved;
  std::vector<std::string> unseen;
  const Json& checks = report.at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const Json& check = checks.at(i);
    const std::string name = check.at("name").string();
    if (check.at("unseen").boolean())
      unseen.push_back(name);
    else if (!check.at("ok").boolean())
      wrong.add(subject_of(name));
    else if (!check.at("skipped").boolean())
      proved.add(subject_of(name));
  }
  proved.remove(wrong);
  std::vector<std::string> parts;
  if (!wrong.empty()) parts.push_back("wrong: " + wrong.text());
  parts.push_back(proved.empty() ? "nothing was proved" : "proved: " + proved.text());
  parts.push_back(unseen.empty() ? "nothing that the format holds was left unseen"
                                 : fmt::format("this dataset could not show what {} would find",
                                               by_check(unseen)));
  parts.front().front() = static_cast<char>(std::toupper(parts.front().front()));
  std::string sentence;
  for (const std::string& part : parts) sentence += (sentence.empty() ? "" : "; ") + part;
  return sentence + ".";
}

std::string by_check(std::span<const std::string> names) {
  std::vector<std::string_view> checks;
  std::map<std::string_view, std::vector<std::string_view>> formats_of;
  for (const std::string& name : names) {
    const auto [format, check] = parted(name);
    std::vector<std::string_view>& formats = formats_of[check];
    if (std::find(checks.begin(), checks.end(), check) == checks.end()) checks.push_back(check);
    if (!format.empty()) formats.push_back(format);
  }
  std::vector<std::string> words;
  for (const std::string_view check : checks)
    words.push_back(formats_of[check].empty()
                        ? std::string(check)
                        : fmt::format("{} ({})", check, fmt::join(formats_of[check], ", ")));
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace terracast::validate
