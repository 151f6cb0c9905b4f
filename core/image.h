#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error.h"

namespace terracast::core {

/// An image of `channels` interleaved values a pixel, row-major, top row first.
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels = 1, T fill = T{})
      : width_(width),
        height_(height),
        channels_(channels),
        data_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                  static_cast<std::size_t>(channels),
              fill) {
    TERRACAST_CHECK(width >= 0 && height >= 0 && channels >= 1, "{}x{}x{}", width, height,
                    channels);
  }

  /// As if made anew, in the memory that is there; values are unspecified until they are written.
  void reshape(int width, int height, int channels) {
    TERRACAST_CHECK(width >= 0 && height >= 0 && channels >= 1, "{}x{}x{}", width, height,
                    channels);
    width_ = width;
    height_ = height;
    channels_ = channels;
    data_.resize(num_pixels() * static_cast<std::size_t>(channels));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return data_.empty(); }
  std::size_t num_pixels() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }

  T& operator()(int x, int y, int channel = 0) { return data_[index(x, y, channel)]; }
  const T& operator()(int x, int y, int channel = 0) const { return data_[index(x, y, channel)]; }

  std::span<T> data() { return data_; }
  std::span<const T> data() const { return data_; }
  std::span<T> row(int y) { return std::span<T>(data_).subspan(index(0, y, 0), row_size()); }
  std::span<const T> row(int y) const {
    return std::span<const T>(data_).subspan(index(0, y, 0), row_size());
  }
  std::size_t row_size() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(channels_);
  }

  bool operator==(const Image&) const = default;

 private:
  std::size_t index(int x, int y, int channel) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels_) +
           static_cast<std::size_t>(channel);
  }
  int width_ = 0;
  int height_ = 0;
  int channels_ = 1;
  std::vector<T> data_;
};

using Image8 = Image<std::uint8_t>;
using Image16 = Image<std::uint16_t>;
using ImageF = Image<float>;
using ImageU32 = Image<std::uint32_t>;

}  // namespace terracast::core
