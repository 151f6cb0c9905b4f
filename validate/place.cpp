#include "validate/place.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

namespace terracast::validate {

namespace {

/// A whole number at the start of a text, which is then cut off.
std::optional<int> take_number(std::string_view& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || value < 0) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

/// ", pixel (12, 300)" at the start of a text, inside an image of that size.
std::optional<Eigen::Vector2i> pixel_at(std::string_view text, const Intrinsics& size) {
  if (!take(text, ", pixel (")) return std::nullopt;
  const std::optional<int> x = take_number(text);
  if (!x || !take(text, ", ")) return std::nullopt;
  const std::optional<int> y = take_number(text);
  if (!y || !take(text, ")") || *x >= size.width_px || *y >= size.height_px) return std::nullopt;
  return Eigen::Vector2i(*x, *y);
}

/// Where a text names a thing, and which.
struct Found {
  std::size_t at = std::string_view::npos;
  std::size_t length = 0;
  Place place;
  bool is_before(const Found& other) const {
    return at < other.at || (at == other.at && length > other.length);
  }
};

/// "<camera>, frame 3": the camera that is named first, of those the one with the longest name.
Found image_in(std::string_view worst, const Sequence& sequence) {
  Found first;
  for (std::size_t camera = 0; camera < sequence.cameras.size(); ++camera) {
    const std::string words = sequence.cameras[camera].name + ", frame ";
    for (std::size_t at = worst.find(words); at != std::string_view::npos;
         at = worst.find(words, at + 1)) {
      Found found{at, words.size(), {0, static_cast<int>(camera), 0, {}}};
      std::string_view rest = worst.substr(at + words.size());
      const std::optional<int> frame = take_number(rest);
      if (!frame || *frame >= sequence.num_frames) continue;
      found.place.frame = *frame;
      found.place.pixel = pixel_at(rest, sequence.cameras[camera].intrinsics);
      if (found.is_before(first)) first = found;
      break;
    }
  }
  return first;
}

/// The file of an image that is named first. COLMAP names images from its folder `images` on.
Found file_in(std::string_view worst, const Sequence& sequence) {
  Found first;
  // Most words name no file, and a dataset may have a million of them.
  worst = worst.substr(0, worst.find('\n'));
  constexpr std::array<std::string_view, 3> kFiles = {".png", ".np", ".mcap#"};
  if (std::none_of(kFiles.begin(), kFiles.end(), [&](std::string_view part) {
        return worst.find(part) != std::string_view::npos;
      }))
    return first;
  constexpr std::string_view kImages = "images/";
  for (std::size_t camera = 0; camera < sequence.cameras.size(); ++camera)
    for (std::size_t frame = 0; frame < sequence.cameras[camera].files.size(); ++frame) {
      const FrameFiles& files = sequence.cameras[camera].files[frame];
      for (std::string_view file :
           {std::string_view(files.color), std::string_view(files.depth),
            std::string_view(files.segmentation), std::string_view(files.flow),
            std::string_view(files.disparity)}) {
        if (const std::size_t images = file.find(kImages); images != std::string_view::npos)
          file.remove_prefix(images + kImages.size());
        if (file.empty()) continue;
        const Found found{worst.find(file),
                          file.size(),
                          {0, static_cast<int>(camera), static_cast<int>(frame), {}}};
        if (found.at != std::string_view::npos && found.is_before(first)) first = found;
      }
    }
  return first;
}

/// A frame of all cameras alike.
Found frame_in(std::string_view worst, const Sequence& sequence) {
  Found found;
  for (const std::string_view words : {"all cameras alike, frame ", "frame "}) {
    if (!worst.starts_with(words)) continue;
    std::string_view rest = worst.substr(words.size());
    const std::optional<int> frame = take_number(rest);
    if (frame && *frame < sequence.num_frames && !sequence.cameras.empty())
      found = {0, words.size(), {0, 0, *frame, {}}};
  }
  return found;
}

}  // namespace

std::optional<Place> place_in(std::string_view worst, const Dataset& dataset) {
  std::size_t index = 0;
  if (dataset.sequences.size() > 1) {
    std::size_t longest = 0;
    for (std::size_t i = 0; i < dataset.sequences.size(); ++i) {
      const std::string& name = dataset.sequences[i].name;
      if (name.size() < longest || !worst.starts_with(name + ": ")) continue;
      longest = name.size();
      index = i;
    }
    if (longest == 0) return std::nullopt;
    worst.remove_prefix(longest + 2);
  }
  if (index >= dataset.sequences.size()) return std::nullopt;
  const Sequence& sequence = dataset.sequences[index];
  for (const auto& look : {&image_in, &frame_in, &file_in}) {
    Found found = look(worst, sequence);
    if (found.at == std::string_view::npos) continue;
    found.place.sequence = static_cast<int>(index);
    return found.place;
  }
  return std::nullopt;
}

}  // namespace terracast::validate
