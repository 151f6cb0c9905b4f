#include "validate/evaluate/results/result_images.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "validate/npy.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
static_assert(std::endian::native == std::endian::little);

void check_size(std::int64_t width, std::int64_t height, const ImageSize& size,
                const std::string& name) {
  if (width != size.width_px || height != size.height_px)
    fail(ErrorKind::Input,
         "{}: {} x {} pixels where the image has {} x {}; results have the image's size", name,
         width, height, size.width_px, size.height_px);
}

template <class Value>
Value value_at(std::span<const std::byte> bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof(Value));
  return value;
}

bool begins_with(std::span<const std::byte> bytes, std::string_view start) {
  return bytes.size() >= start.size() && std::memcmp(bytes.data(), start.data(), start.size()) == 0;
}
bool is_png(std::span<const std::byte> bytes) { return begins_with(bytes, "\x89PNG\r\n\x1a\n"); }
bool is_npy(std::span<const std::byte> bytes) { return begins_with(bytes, "\x93NUMPY"); }
bool is_zip(std::span<const std::byte> bytes) { return begins_with(bytes, "PK"); }
bool is_pfm(std::span<const std::byte> bytes) {
  return begins_with(bytes, "Pf") || begins_with(bytes, "PF");
}

/// A PNG whose header says the right size, decoded.
std::variant<core::Image8, core::Image16> decode_png(std::span<const std::byte> bytes,
                                                     const std::string& name,
                                                     const ImageSize& size) {
  constexpr std::size_t kWidthAt = 16;  // behind the signature, length and name of IHDR
  if (bytes.size() < kWidthAt + 8) fail(ErrorKind::Input, "{}: truncated PNG", name);
  const auto big_endian = [&](std::size_t at) {
    std::int64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value = value << 8 | std::to_integer<std::int64_t>(bytes[at + i]);
    return value;
  };
  check_size(big_endian(kWidthAt), big_endian(kWidthAt + 4), size, name);
  return core::decode_png(
      bytes, name,
      static_cast<std::size_t>(size.width_px) * static_cast<std::size_t>(size.height_px));
}

/// 16 bits, so many channels.
core::Image16 decode_png16(std::span<const std::byte> bytes, const std::string& name,
                           const ImageSize& size, int channels, const char* what) {
  auto decoded = decode_png(bytes, name, size);
  auto* image = std::get_if<core::Image16>(&decoded);
  if (image == nullptr || image->channels() != channels)
    fail(ErrorKind::Input, "{}: a PNG of {} channels of {} bits; {} is right", name,
         image != nullptr ? image->channels() : std::get<core::Image8>(decoded).channels(),
         image != nullptr ? 16 : 8, what);
  return std::move(*image);
}

/// An npy of floats as an image of so many channels, (height, width, channels) or (channels,
/// height, width); of one channel (height, width) too.
core::ImageF image_from_npy(const NpyArray& array, const std::string& name, const ImageSize& size,
                            std::size_t channels) {
  std::vector<std::size_t> shape = array.shape;
  // (1, …): a batch of one.
  if (shape.size() == 4 && shape[0] == 1) shape.erase(shape.begin());
  if (channels == 1 && shape.size() == 3 && shape[0] == 1) shape.erase(shape.begin());
  if (channels == 1 && shape.size() == 3 && shape[2] == 1) shape.pop_back();
  const auto width = static_cast<std::size_t>(size.width_px);
  const auto height = static_cast<std::size_t>(size.height_px);
  const bool is_plane = channels == 1 && shape == std::vector<std::size_t>{height, width};
  const bool is_interleaved = shape == std::vector<std::size_t>{height, width, channels};
  const bool is_planar = shape == std::vector<std::size_t>{channels, height, width};
  if (!is_plane && !is_interleaved && !is_planar)
    fail(ErrorKind::Input, "{}: an array of the shape ({}); {} is right", name,
         fmt::join(array.shape, ", "),
         channels == 1
             ? fmt::format("({}, {})", height, width)
             : fmt::format("({0}, {1}, {2}) or ({2}, {0}, {1})", height, width, channels));
  if (array.kind != 'f' || (array.item_size != 4 && array.item_size != 8))
    fail(ErrorKind::Input, "{}: values of type {}{}; float32 or float64 is right", name, array.kind,
         array.item_size);
  const auto number = [&](std::size_t i) {
    return array.item_size == 4 ? value_at<float>(array.bytes, 4 * i)
                                : static_cast<float>(value_at<double>(array.bytes, 8 * i));
  };
  core::ImageF image(size.width_px, size.height_px, static_cast<int>(channels));
  const std::size_t num_pixels = width * height;
  for (std::size_t i = 0; i < num_pixels; ++i)
    for (std::size_t c = 0; c < channels; ++c)
      image.data()[channels * i + c] =
          number(is_planar && !is_interleaved ? c * num_pixels + i : channels * i + c);
  return image;
}

/// PFM of one channel: "Pf", width and height, scale (below 0: little-endian), each followed by
/// one blank or line end; rows from the bottom up.
core::ImageF parse_pfm(std::span<const std::byte> bytes, const std::string& name,
                       const ImageSize& size) {
  std::size_t at = 0;
  const auto word = [&] {
    constexpr std::size_t kLongest = 32;
    std::string text;
    while (at < bytes.size() && std::isspace(std::to_integer<int>(bytes[at])) != 0) ++at;
    while (at < bytes.size() && std::isspace(std::to_integer<int>(bytes[at])) == 0 &&
           text.size() < kLongest)
      text += static_cast<char>(bytes[at++]);
    return text;
  };
  const std::string kind = word();
  if (kind != "Pf")
    fail(ErrorKind::Input, "{}: a PFM of the kind \"{}\"; \"Pf\", one channel, is right", name,
         kind.substr(0, 2));
  const std::string where = name + ": PFM header";
  const std::int64_t width = parse_integer(word(), where);
  const std::int64_t height = parse_integer(word(), where);
  const double scale = parse_number(word(), where);
  check_size(width, height, size, name);
  if (scale == 0.0)
    fail(ErrorKind::Input, "{}: scale 0; below 0 for little-endian values is right", where);
  ++at;  // the one blank behind the scale
  const std::size_t num_pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (bytes.size() < at || bytes.size() - at != 4 * num_pixels)
    fail(ErrorKind::Input, "{}: {} bytes of values where {} x {} pixels need {}", name,
         bytes.size() - std::min(at, bytes.size()), width, height, 4 * num_pixels);
  core::ImageF image(size.width_px, size.height_px);
  for (int row = 0; row < size.height_px; ++row)
    for (int x = 0; x < size.width_px; ++x, at += 4) {
      auto bits = value_at<std::uint32_t>(bytes, at);
      if (scale > 0.0)  // big-endian
        bits = bits << 24 | (bits & 0xFF00U) << 8 | (bits >> 8 & 0xFF00U) | bits >> 24;
      image(x, size.height_px - 1 - row) = std::bit_cast<float>(bits);
    }
  return image;
}

core::ImageF parse_flo(std::span<const std::byte> bytes, const std::string& name,
                       const ImageSize& size) {
  constexpr std::size_t kHeader = 12;
  if (bytes.size() < kHeader) fail(ErrorKind::Input, "{}: truncated .flo", name);
  check_size(value_at<std::int32_t>(bytes, 4), value_at<std::int32_t>(bytes, 8), size, name);
  core::ImageF flow(size.width_px, size.height_px, 2);
  if (bytes.size() - kHeader != 4 * flow.data().size())
    fail(ErrorKind::Input, "{}: {} bytes of values where {} x {} pixels need {}", name,
         bytes.size() - kHeader, size.width_px, size.height_px, 4 * flow.data().size());
  std::memcpy(flow.data().data(), bytes.data() + kHeader, 4 * flow.data().size());
  return flow;
}

core::ImageF flow_from_kitti(const core::Image16& png) {
  core::ImageF flow(png.width(), png.height(), 2, kUnknown);
  for (std::size_t i = 0; i < png.num_pixels(); ++i) {
    const std::uint16_t* rgb = &png.data()[3 * i];
    if (rgb[2] == 0) continue;
    for (std::size_t c = 0; c < 2; ++c)
      flow.data()[2 * i + c] = (static_cast<float>(rgb[c]) - 32768.0F) / 64.0F;
  }
  return flow;
}

/// Sets a pixel to NaN in all channels where one is no value.
/// most  a magnitude beyond which a value stands for none
void mark_unknown(core::ImageF& image, float most) {
  const auto channels = static_cast<std::size_t>(image.channels());
  for (std::size_t i = 0; i < image.num_pixels(); ++i) {
    bool is_known = true;
    for (std::size_t c = 0; c < channels; ++c)
      is_known = is_known && std::abs(image.data()[channels * i + c]) <= most;
    if (is_known) continue;
    for (std::size_t c = 0; c < channels; ++c) image.data()[channels * i + c] = kUnknown;
  }
}

/// Sets values that are not above 0 and finite to NaN.
void mark_not_positive(core::ImageF& image) {
  for (float& value : image.data())
    if (!(value > 0.0F) || !std::isfinite(value)) value = kUnknown;
}

/// Counts of 1/256, 0 unknown.
core::ImageF from_counts(const core::Image16& png) {
  core::ImageF image(png.width(), png.height());
  for (std::size_t i = 0; i < png.num_pixels(); ++i)
    image.data()[i] = static_cast<float>(png.data()[i]) / 256.0F;
  return image;
}

core::ImageF depth_from_rgba(const core::Image8& png) {
  core::ImageF depth(png.width(), png.height());
  for (std::size_t i = 0; i < png.num_pixels(); ++i) {
    // OpenCV hands out B, G, R, A, which are taken for the bytes of a little-endian float.
    const std::uint8_t* rgba = &png.data()[4 * i];
    const std::array<std::uint8_t, 4> bytes{rgba[2], rgba[1], rgba[0], rgba[3]};
    depth.data()[i] = std::bit_cast<float>(bytes);
  }
  return depth;
}

[[noreturn]] void refuse(const std::string& name, const char* known) {
  fail(ErrorKind::Input, "{}: not a file of a known format ({})", name, known);
}

}  // namespace

std::vector<std::string> flow_extensions() { return {".flo", ".png", ".npy", ".npz"}; }
std::vector<std::string> depth_extensions() { return {".npy", ".png", ".pfm"}; }
std::vector<std::string> disparity_extensions() { return {".png", ".pfm", ".npy"}; }
std::vector<std::string> scene_flow_extensions() { return {".npy"}; }

core::ImageF read_result(const std::filesystem::path& file, const ImageSize& size,
                         ParseImage* parse) {
  constexpr std::size_t kHeaders = std::size_t{1} << 20;
  const std::size_t num_pixels =
      static_cast<std::size_t>(size.width_px) * static_cast<std::size_t>(size.height_px);
  return parse(core::read_file(file, kHeaders + 24 * num_pixels), file.string(), size);
}

core::ImageF parse_flow(std::span<const std::byte> bytes, const std::string& name,
                        const ImageSize& size) {
  core::ImageF flow;
  constexpr std::size_t kTag = 4;
  if (bytes.size() >= kTag && value_at<float>(bytes, 0) == 202021.25F) {
    flow = parse_flo(bytes, name, size);
  } else if (is_png(bytes)) {
    return flow_from_kitti(
        decode_png16(bytes, name, size, 3, "KITTI's flow, 3 channels of 16 bits,"));
  } else if (is_npy(bytes)) {
    flow = image_from_npy(parse_npy(bytes, name), name, size, 2);
  } else if (is_zip(bytes)) {
    const auto arrays = parse_npz(bytes, name);
    const auto found = arrays.find("flow_fwd");
    if (found == arrays.end())
      fail(ErrorKind::Input, "{}: no array flow_fwd, as TartanAir's flow has", name);
    flow = image_from_npy(found->second, name + "/flow_fwd", size, 2);
  } else {
    refuse(name, ".flo, KITTI's PNG, .npy, TartanAir's .npz");
  }
  mark_unknown(flow, 1e9F);  // Middlebury's; no image is so wide
  return flow;
}

core::ImageF parse_depth(std::span<const std::byte> bytes, const std::string& name,
                         const ImageSize& size) {
  core::ImageF depth;
  if (is_npy(bytes)) {
    depth = image_from_npy(parse_npy(bytes, name), name, size, 1);
  } else if (is_pfm(bytes)) {
    depth = parse_pfm(bytes, name, size);
  } else if (is_png(bytes)) {
    auto decoded = decode_png(bytes, name, size);
    const auto* counts = std::get_if<core::Image16>(&decoded);
    const auto* rgba = std::get_if<core::Image8>(&decoded);
    if (counts != nullptr && counts->channels() == 1)
      depth = from_counts(*counts);
    else if (rgba != nullptr && rgba->channels() == 4)
      depth = depth_from_rgba(*rgba);
    else
      fail(ErrorKind::Input,
           "{}: a PNG of {} channels; KITTI's depth (16 bit grey) or TartanAir's (8 bit RGBA) is "
           "right",
           name, counts != nullptr ? counts->channels() : rgba->channels());
  } else {
    refuse(name, ".npy, .pfm, KITTI's or TartanAir's PNG");
  }
  mark_not_positive(depth);
  return depth;
}

core::ImageF parse_disparity(std::span<const std::byte> bytes, const std::string& name,
                             const ImageSize& size) {
  core::ImageF disparity;
  if (is_npy(bytes))
    disparity = image_from_npy(parse_npy(bytes, name), name, size, 1);
  else if (is_pfm(bytes))
    disparity = parse_pfm(bytes, name, size);
  else if (is_png(bytes))
    disparity = from_counts(decode_png16(bytes, name, size, 1, "KITTI's disparity, 16 bit grey,"));
  else
    refuse(name, "KITTI's PNG, .pfm, .npy");
  mark_not_positive(disparity);
  return disparity;
}

core::ImageF parse_scene_flow(std::span<const std::byte> bytes, const std::string& name,
                              const ImageSize& size) {
  if (!is_npy(bytes)) refuse(name, ".npy");
  core::ImageF scene_flow = image_from_npy(parse_npy(bytes, name), name, size, 3);
  mark_unknown(scene_flow, std::numeric_limits<float>::max());
  return scene_flow;
}

}  // namespace terracast::validate
