#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <set>
#include <stdexcept>

#include "core/error.h"
#include "core/image_io.h"

namespace terracast::core {

namespace {

class MemoryOutput : public Imf::OStream {
 public:
  MemoryOutput() : Imf::OStream("memory") {}
  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (position_ + size > bytes_.size()) bytes_.resize(position_ + size);
    std::memcpy(bytes_.data() + position_, bytes, size);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  void reserve(std::size_t size) { bytes_.reserve(size); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
  std::size_t position_ = 0;
};

class MemoryInput : public Imf::IStream {
 public:
  explicit MemoryInput(std::span<const std::byte> bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char out[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (count < 0 || position_ > bytes_.size() || size > bytes_.size() - position_)
      throw std::runtime_error("it ends too early");
    std::memcpy(out, bytes_.data() + position_, size);
    position_ += size;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t position_ = 0;
};

std::size_t num_pixels(const ExrPart& part) {
  return static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height);
}

Imf::PixelType pixel_type(ExrChannel::Type type) {
  switch (type) {
    case ExrChannel::Type::Half:
      return Imf::HALF;
    case ExrChannel::Type::Uint:
      return Imf::UINT;
    case ExrChannel::Type::Float:
      break;
  }
  return Imf::FLOAT;
}

Imf::Header header_of(const ExrPart& part) {
  TERRACAST_CHECK(part.width > 0 && part.height > 0 && !part.channels.empty(),
                  "part {}: {}x{}, {} channels", part.name, part.width, part.height,
                  part.channels.size());
  Imf::Header header(part.width, part.height);
  switch (part.compression) {
    case ExrPart::Compression::None:
      header.compression() = Imf::NO_COMPRESSION;
      break;
    case ExrPart::Compression::Rle:
      header.compression() = Imf::RLE_COMPRESSION;
      break;
    case ExrPart::Compression::Zips:
      header.compression() = Imf::ZIPS_COMPRESSION;
      break;
  }
  header.setType(Imf::SCANLINEIMAGE);
  if (!part.name.empty()) header.setName(part.name);
  for (const ExrChannel& channel : part.channels) {
    TERRACAST_CHECK(header.channels().findChannel(channel.name) == nullptr,
                    "part {}: two channels {}", part.name, channel.name);
    const std::size_t size = channel.type == ExrChannel::Type::Uint ? channel.values_uint.size()
                                                                    : channel.values_float.size();
    TERRACAST_CHECK(size == num_pixels(part), "part {}: {} values for {} of {}x{}", part.name, size,
                    channel.name, part.width, part.height);
    header.channels().insert(channel.name, Imf::Channel(pixel_type(channel.type)));
  }
  for (const auto& [name, text] : part.attributes) {
    TERRACAST_CHECK(header.find(name.c_str()) == header.end(), "part {}: {} is the format's own",
                    part.name, name);
    header.insert(name, Imf::StringAttribute(text));
  }
  return header;
}

std::vector<Imath::half> halves(const ExrPart& part, const ExrChannel& channel) {
  std::vector<Imath::half> values(channel.values_float.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = Imath::half(channel.values_float[i]);
    TERRACAST_CHECK(!values[i].isInfinity() || std::isinf(channel.values_float[i]),
                    "part {}: {} of {} passes the 65504 of a half", part.name,
                    channel.values_float[i], channel.name);
  }
  return values;
}

void write_part(const ExrPart& part, Imf::OutputPart& output) {
  Imf::FrameBuffer frame;
  std::deque<std::vector<Imath::half>> rounded;  // lives until the pixels are written
  for (const ExrChannel& channel : part.channels) {
    const void* values = channel.values_float.data();
    std::size_t value_bytes = sizeof(float);
    if (channel.type == ExrChannel::Type::Uint) {
      values = channel.values_uint.data();
    } else if (channel.type == ExrChannel::Type::Half) {
      rounded.push_back(halves(part, channel));
      values = rounded.back().data();
      value_bytes = sizeof(Imath::half);
    }
    // OpenEXR only reads through the pointer of an output's frame buffer.
    frame.insert(
        channel.name,
        Imf::Slice(pixel_type(channel.type), const_cast<char*>(static_cast<const char*>(values)),
                   value_bytes, value_bytes * static_cast<std::size_t>(part.width)));
  }
  output.setFrameBuffer(frame);
  output.writePixels(part.height);
}

/// Walks over the attributes of every header before OpenEXR does: it takes memory by their stated
/// sizes before it finds that the file has no such bytes.
class HeaderScan {
 public:
  HeaderScan(std::span<const std::byte> bytes, const std::string& name)
      : bytes_(bytes), name_(name) {}

  void run() {
    constexpr std::size_t kFlagsAt = 5;
    constexpr std::size_t kHeadersAt = 8;
    constexpr std::byte kMultiPart{0x10};
    need(kHeadersAt);
    const bool is_multi_part = (bytes_[kFlagsAt] & kMultiPart) != std::byte{0};
    at_ = kHeadersAt;
    do {
      while (!text().empty()) skip_attribute();
    } while (is_multi_part && peek() != std::byte{0});
  }

 private:
  void need(std::size_t count) const {
    if (count > bytes_.size() - at_)
      fail(ErrorKind::Input, "{}: a damaged EXR: its header ends too early", name_);
  }
  std::byte peek() const {
    need(1);
    return bytes_[at_];
  }
  /// Up to the next zero byte, which is passed.
  std::string text() {
    std::string result;
    for (; peek() != std::byte{0}; ++at_) {
      constexpr std::size_t kLongestName = 255;
      if (result.size() == kLongestName)
        fail(ErrorKind::Input, "{}: a damaged EXR: a name of more than {} letters", name_,
             kLongestName);
      result += static_cast<char>(bytes_[at_]);
    }
    ++at_;
    return result;
  }
  void skip_attribute() {
    const std::string type = text();
    // These hold lengths of their own inside; no file of ours has them.
    for (const char* nested : {"preview", "stringvector", "idmanifest"})
      if (type == nested)
        fail(ErrorKind::Input, "{}: an attribute of type {} is not supported", name_, type);
    need(4);
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i)
      size |= std::to_integer<std::size_t>(bytes_[at_ + i]) << (8 * i);
    at_ += 4;
    need(size);
    at_ += size;
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

/// What a part claims, checked before memory is taken for it.
void check_claims(const Imf::Header& header, const std::string& name, std::size_t num_bytes,
                  std::size_t max_pixels) {
  const Imath::Box2i window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width <= 0 || height <= 0)
    fail(ErrorKind::Input, "{}: a damaged EXR: {} x {} pixels", name, width, height);
  std::size_t pixel_bytes = 0;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
      fail(ErrorKind::Input, "{}: channel {} is subsampled, which is not supported", name,
           channel.name());
    pixel_bytes += channel.channel().type == Imf::HALF ? 2 : 4;
  }
  const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (static_cast<std::uint64_t>(height) > max_pixels ||
      static_cast<std::uint64_t>(width) > max_pixels || pixels > max_pixels)
    fail(ErrorKind::Input, "{}: {} x {} pixels are more than the {} allowed", name, width, height,
         max_pixels);
  // The lossless schemes that the format has shrink at most about a thousand times.
  const std::uint64_t max_growth = header.compression() == Imf::NO_COMPRESSION ? 1 : 4096;
  if (pixels / max_growth * pixel_bytes > num_bytes)
    fail(ErrorKind::Input, "{}: a damaged EXR: {} bytes cannot hold {} x {} pixels of {} bytes",
         name, num_bytes, width, height, pixel_bytes);
}

/// An uncompressed line that is too short is read by OpenEXR all the same, filled up with what was
/// in memory.
void check_line_sizes(Imf::InputPart& input, std::size_t line_bytes, const std::string& name) {
  const Imf::Header& header = input.header();
  if (header.compression() != Imf::NO_COMPRESSION || header.hasTileDescription()) return;
  for (int y = header.dataWindow().min.y; y <= header.dataWindow().max.y; ++y) {
    const char* data = nullptr;
    int size = 0;
    input.rawPixelData(y, data, size);
    if (static_cast<std::size_t>(size) != line_bytes)
      fail(ErrorKind::Input, "{}: a damaged EXR: line {} has {} bytes instead of {}", name, y, size,
           line_bytes);
  }
}

ExrImage read_part(Imf::MultiPartInputFile& file, int index, const std::string& name) {
  const Imf::Header& header = file.header(index);
  if (header.hasType() && header.type() != Imf::SCANLINEIMAGE && header.type() != Imf::TILEDIMAGE)
    fail(ErrorKind::Input, "{}: part {} is of type {}, which is not supported", name, index,
         header.type());
  const Imath::Box2i window = header.dataWindow();
  ExrImage image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  if (header.hasName()) image.name = header.name();
  for (auto attribute = header.begin(); attribute != header.end(); ++attribute) {
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute.attribute());
    if (text != nullptr && std::strcmp(attribute.name(), "name") != 0 &&
        std::strcmp(attribute.name(), "type") != 0)
      image.attributes[attribute.name()] = text->value();
  }
  Imf::FrameBuffer frame;
  const auto width = static_cast<std::size_t>(image.width);
  std::size_t line_bytes = 0;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    line_bytes += width * (channel.channel().type == Imf::HALF ? 2 : 4);
    // Every value of ours has four bytes; OpenEXR widens HALF to FLOAT.
    const auto insert = [&](Imf::PixelType type, void* values) {
      frame.insert(channel.name(), Imf::Slice::Make(type, values, window, 4, 4 * width));
    };
    if (channel.channel().type == Imf::UINT) {
      ImageU32& values = image.uint_channels[channel.name()];
      values = ImageU32(image.width, image.height);
      insert(Imf::UINT, values.data().data());
    } else {
      ImageF& values = image.float_channels[channel.name()];
      values = ImageF(image.width, image.height);
      insert(Imf::FLOAT, values.data().data());
    }
  }
  Imf::InputPart input(file, index);
  check_line_sizes(input, line_bytes, name);
  input.setFrameBuffer(frame);
  input.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

std::vector<std::byte> encode_exr(const std::vector<ExrPart>& parts) {
  TERRACAST_CHECK(!parts.empty(), "an EXR file has one part at least");
  std::vector<Imf::Header> headers;
  std::set<std::string> names;
  std::size_t num_values = 0;
  for (const ExrPart& part : parts) {
    headers.push_back(header_of(part));
    TERRACAST_CHECK(parts.size() == 1 || (!part.name.empty() && names.insert(part.name).second),
                    "part \"{}\" needs a name of its own", part.name);
    num_values += num_pixels(part) * part.channels.size();
  }
  MemoryOutput memory;
  memory.reserve(4 * num_values + 4096);
  try {
    constexpr int kNumThreads = 0;  // in this thread: our own loops already use the others
    Imf::MultiPartOutputFile file(memory, headers.data(), static_cast<int>(headers.size()), false,
                                  kNumThreads);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      Imf::OutputPart output(file, static_cast<int>(i));
      write_part(parts[i], output);
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fail(ErrorKind::Internal, "an EXR cannot be encoded: {}", error.what());
  }
  return memory.take();
}

std::vector<ExrImage> decode_exr(std::span<const std::byte> bytes, const std::string& name,
                                 std::size_t max_pixels) {
  static constexpr unsigned char kMagic[] = {0x76, 0x2f, 0x31, 0x01};
  if (bytes.size() < sizeof kMagic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    fail(ErrorKind::Input, "{}: not an EXR (its first bytes say so)", name);
  HeaderScan(bytes, name).run();
  try {
    MemoryInput memory(bytes);
    constexpr int kNumThreads = 0;
    constexpr bool kRebuildOffsets = false;  // a damaged file is refused, never guessed at
    Imf::MultiPartInputFile file(memory, kNumThreads, kRebuildOffsets);
    for (int i = 0; i < file.parts(); ++i)
      check_claims(file.header(i), name, bytes.size(), max_pixels);
    std::vector<ExrImage> images;
    for (int i = 0; i < file.parts(); ++i) images.push_back(read_part(file, i, name));
    return images;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(ErrorKind::Input, "{}: a damaged EXR: {}", name, error.what());
  }
}

}  // namespace terracast::core
