#include "tests/verdict/corruptions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <variant>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/jobs/draws.h"
#include "validate/npy.h"
#include "validate/text.h"

namespace terracast::test {

namespace {

namespace fs = std::filesystem;

/// Files below a folder whose path from it holds one of some words, by the folder that they lie in; in order.
std::map<fs::path, std::vector<fs::path>> files_of(const fs::path& folder,
                                                   const std::vector<std::string>& words,
                                                   const std::string& extension) {
  std::map<fs::path, std::vector<fs::path>> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string path = entry.path().lexically_relative(folder).generic_string();
    if (entry.is_regular_file() && entry.path().extension() == extension &&
        std::any_of(words.begin(), words.end(),
                    [&](const std::string& word) { return path.find(word) != std::string::npos; }))
      found[entry.path().parent_path()].push_back(entry.path());
  }
  for (auto& [place, files] : found) std::sort(files.begin(), files.end());
  return found;
}

std::map<fs::path, std::vector<fs::path>> images_of(const fs::path& folder) {
  return files_of(folder, {"image"}, ".png");
}

/// One of several folders of files.
const std::vector<fs::path>& one_of(const std::map<fs::path, std::vector<fs::path>>& files,
                                    Draws& draws) {
  return std::next(files.begin(), draws.below(static_cast<int>(files.size())))->second;
}

core::Image8 image_of(const fs::path& file) {
  return std::get<core::Image8>(core::decode_png(core::read_file(file), file.string()));
}

/// Changes the float32 numbers of an npy file, all of which lie at its end.
void edit_floats(const fs::path& file, const std::function<void(std::span<float>)>& change) {
  std::vector<std::byte> bytes = core::read_file(file);
  const std::size_t size = validate::parse_npy(bytes, file.string()).bytes.size();
  std::vector<float> values(size / sizeof(float));
  std::memcpy(values.data(), bytes.data() + bytes.size() - size, size);
  change(values);
  std::memcpy(bytes.data() + bytes.size() - size, values.data(), size);
  core::write_file(file, bytes);
}

bool exchange_images(const fs::path& folder, std::uint64_t seed) {
  Draws draws(seed, "exchanged images");
  auto images = images_of(folder);
  std::erase_if(images, [](const auto& one) { return one.second.size() < 2; });
  if (images.empty()) return false;
  const std::vector<fs::path>& files = one_of(images, draws);
  const std::vector<std::byte> first = core::read_file(files.front());
  core::write_file(files.front(), core::read_file(files.back()));
  core::write_file(files.back(), first);
  return true;
}

/// All images of a camera, upside down.
bool turn_images(const fs::path& folder, std::uint64_t seed) {
  Draws draws(seed, "turned images");
  const auto images = images_of(folder);
  if (images.empty()) return false;
  for (const fs::path& file : one_of(images, draws)) {
    const core::Image8 image = image_of(file);
    core::Image8 turned = image;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        for (int k = 0; k < image.channels(); ++k)
          turned(x, y, k) = image(x, image.height() - 1 - y, k);
    core::write_file(file, core::encode_png(turned));
  }
  return true;
}

/// All depths of a camera, by up to 5 %.
bool scale_depths(const fs::path& folder, std::uint64_t seed) {
  Draws draws(seed, "scaled depths");
  const auto depths = files_of(folder, {"depth", "range/"}, ".npy");
  if (depths.empty()) return false;
  const auto factor = static_cast<float>(1.0 + draws.between(0.02, 0.05));
  for (const fs::path& file : one_of(depths, draws))
    edit_floats(file, [&](std::span<float> values) {
      for (float& value : values) value *= factor;
    });
  return true;
}

/// All flow of a camera, as if the frames were in the other order.
bool negate_flow(const fs::path& folder, std::uint64_t seed) {
  Draws draws(seed, "negated flow");
  auto flows = files_of(folder, {"flow"}, ".npy");
  std::erase_if(flows, [](const auto& one) {
    return one.second.front().filename().string().find("mask") != std::string::npos;
  });
  if (flows.empty()) return false;
  for (const fs::path& file : one_of(flows, draws))
    if (file.filename().string().find("mask") == std::string::npos)
      edit_floats(file, [](std::span<float> values) {
        for (float& value : values) value = -value;
      });
  return true;
}

/// One camera's place in one frame, by a few metres to the north.
bool move_place(const fs::path& folder, std::uint64_t seed) {
  Draws draws(seed, "moved place");
  const auto places = files_of(folder, {"georeference.csv"}, ".csv");
  if (places.empty()) return false;
  const fs::path file = one_of(places, draws).front();
  const std::string text = core::read_text_file(file);
  std::vector<std::string> lines;
  for (const validate::TextLine& line : validate::split_lines(text)) lines.emplace_back(line.text);
  const std::vector<std::string_view> names = validate::split_at(lines.front(), ',');
  const auto column = std::find(names.begin(), names.end(), "lat_deg") - names.begin();
  std::string& line =
      lines[static_cast<std::size_t>(1 + draws.below(static_cast<int>(lines.size()) - 1))];
  std::vector<std::string> words;
  for (const std::string_view word : validate::split_at(line, ',')) words.emplace_back(word);
  if (static_cast<std::size_t>(column) >= words.size()) return false;
  std::string& latitude = words[static_cast<std::size_t>(column)];
  latitude = fmt::format("{:.12f}", std::stod(latitude) + draws.between(2e-5, 5e-5));
  line = fmt::format("{}", fmt::join(words, ","));
  core::write_file(file, fmt::format("{}\n", fmt::join(lines, "\n")));
  return true;
}

}  // namespace

const std::vector<Corruption>& corruptions() {
  static const std::vector<Corruption> all{
      {"images of two frames exchanged",
       &exchange_images,
       {"photometric_frames", "photometric_correlation", "structure"}},
      {"images upside down", &turn_images, {"photometric_correlation", "photometric_frames"}},
      {"depths longer", &scale_depths, {"reprojection", "stereo_scale"}},
      {"flow of the other sign", &negate_flow, {"flow"}},
      {"a place beside its own", &move_place, {"georeference_position"}}};
  return all;
}

}  // namespace terracast::test
