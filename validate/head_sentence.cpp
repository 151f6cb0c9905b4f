#include "validate/head_sentence.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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
    Subject{"moving", "what moves"},
    Subject{"sensor", "samples of other sensors"},
    Subject{"colmap_sparse", "what COLMAP triangulates"},
    Subject{"colmap_free", "what COLMAP reconstructs"},
    Subject{"colmap_georegister", "what COLMAP georegisters"},
    Subject{"colmap", "COLMAP's model"},
};

/// returns  the check's own name, without the format before it, where no subject is known
std::string_view subject_of(std::string_view check) {
  if (const std::size_t slash = check.rfind('/'); slash != std::string_view::npos)
    check.remove_prefix(slash + 1);
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
  Words wrong, proved, unseen;
  const Json& checks = report.at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const Json& check = checks.at(i);
    const std::string name = check.at("name").string();
    if (check.at("unseen").boolean())
      unseen.add(name);
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
                                               unseen.text()));
  parts.front().front() = static_cast<char>(std::toupper(parts.front().front()));
  std::string sentence;
  for (const std::string& part : parts) sentence += (sentence.empty() ? "" : "; ") + part;
  return sentence + ".";
}

}  // namespace terracast::validate
