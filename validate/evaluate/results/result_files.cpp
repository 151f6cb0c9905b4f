#include "validate/evaluate/results/result_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "validate/dataset.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// The number that the first digits of a name are; nothing without digits, or with more than nine.
std::optional<int> frame_of_name(const std::string& name) {
  constexpr const char* kDigits = "0123456789";
  constexpr std::size_t kMostDigits = 9;
  const std::size_t begin = name.find_first_of(kDigits);
  if (begin == std::string::npos) return std::nullopt;
  std::size_t end = name.find_first_not_of(kDigits, begin);
  if (end == std::string::npos) end = name.size();
  // KITTI raw numbers its frames with ten digits, most of them 0.
  const std::size_t first = std::min(name.find_first_not_of('0', begin), end);
  if (end - first > kMostDigits) return std::nullopt;
  return first == end ? 0 : std::stoi(name.substr(first, end - first));
}

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace

NumberedFiles find_numbered_files(const fs::path& folder, int num_frames,
                                  const std::vector<std::string>& extensions,
                                  const std::vector<std::string>& ignored) {
  NumberedFiles files{.folder = folder, .by_frame = {}, .notes = {}};
  int num_without = 0, num_beyond = 0;
  std::string first_without, first_beyond;
  for (const std::string& name : list_folder(folder)) {
    std::error_code error;
    if (!fs::is_regular_file(folder / name, error)) continue;
    const std::string extension = lower(fs::path(name).extension().string());
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end() ||
        std::any_of(ignored.begin(), ignored.end(),
                    [&](const std::string& end) { return name.ends_with(end); }))
      continue;
    const std::optional<int> frame = frame_of_name(name);
    if (!frame) {
      if (num_without++ == 0) first_without = name;
    } else if (*frame >= num_frames) {
      if (num_beyond++ == 0) first_beyond = name;
    } else {
      const auto [entry, is_new] = files.by_frame.emplace(*frame, name);
      if (!is_new)
        fail(ErrorKind::Input,
             "{}: \"{}\" and \"{}\" are both frame {} by the first digits of their names; leave "
             "one",
             folder.string(), entry->second, name, *frame);
    }
  }
  if (files.by_frame.empty())
    fail(
        ErrorKind::Input,
        "{}: no file of a frame; files are found by number, as \"000000{}\" to \"{}{}\" ({} count)",
        folder.string(), extensions.front(), frame_digits(num_frames - 1), extensions.front(),
        fmt::join(extensions, ", "));
  if (num_without > 0)
    files.notes.push_back(fmt::format("{} of {} files are not counted: no number in \"{}\"",
                                      folder.string(), num_without, first_without));
  if (num_beyond > 0)
    files.notes.push_back(
        fmt::format("{}: {} files are not counted: \"{}\" is beyond the {} frames", folder.string(),
                    num_beyond, first_beyond, num_frames));
  return files;
}

}  // namespace terracast::validate
