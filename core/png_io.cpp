#include <libdeflate.h>
#include <png.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>

#include "core/error.h"
#include "core/image_io.h"

namespace terracast::core {

namespace {

// ---------------------------------------------------------------------------------------------
// Encoding: own filtering and one libdeflate stream. libpng spends 30 ns a pixel in zlib where
// libdeflate needs 20.

constexpr std::size_t kMaxChunkBytes = (std::size_t{1} << 31) - 1;

void append_u32(std::vector<std::byte>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8)
    out.push_back(static_cast<std::byte>((value >> shift) & 0xffU));
}

void append_chunk(std::vector<std::byte>& out, const char* type, std::span<const std::byte> data) {
  append_u32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(type[i]));
  out.insert(out.end(), data.begin(), data.end());
  append_u32(out, libdeflate_crc32(0, out.data() + begin, out.size() - begin));
}

/// How large the residuals of a filter are: the sum of their sizes as signed bytes. Small ones
/// compress well.
std::uint64_t residual_size(const std::uint8_t* values, std::size_t count) {
  std::uint64_t sum = 0;
  for (std::size_t begin = 0; begin < count; begin += 4096) {  // 4096 * 128 fits 32 bits: vectors
    std::uint32_t part = 0;
    const std::size_t end = std::min(begin + 4096, count);
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t value = values[i];
      part += value < 128 ? value : 256 - value;
    }
    sum += part;
  }
  return sum;
}

/// Writes the filter's number and the filtered row, of SUB (1) or UP (2) the one with the smaller
/// residuals.
void filter_row(const std::uint8_t* row, const std::uint8_t* above, std::size_t row_bytes,
                std::size_t pixel_bytes, std::uint8_t* scratch, std::uint8_t* out) {
  std::uint8_t* sub = out + 1;
  std::copy_n(row, pixel_bytes, sub);
  for (std::size_t i = pixel_bytes; i < row_bytes; ++i)
    sub[i] = static_cast<std::uint8_t>(row[i] - row[i - pixel_bytes]);
  out[0] = 1;
  if (above == nullptr) return;
  for (std::size_t i = 0; i < row_bytes; ++i)
    scratch[i] = static_cast<std::uint8_t>(row[i] - above[i]);
  if (residual_size(scratch, row_bytes) >= residual_size(sub, row_bytes)) return;
  std::copy_n(scratch, row_bytes, sub);
  out[0] = 2;
}

std::uint8_t color_type(int channels) {
  static constexpr std::uint8_t kTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA,
                                            PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
  return kTypes[channels - 1];
}

/// A row in the file's byte order.
void serialise(std::span<const std::uint8_t> row, std::uint8_t* out) {
  std::copy(row.begin(), row.end(), out);
}
void serialise(std::span<const std::uint16_t> row, std::uint8_t* out) {
  for (std::size_t i = 0; i < row.size(); ++i) {
    out[2 * i] = static_cast<std::uint8_t>(row[i] >> 8);
    out[2 * i + 1] = static_cast<std::uint8_t>(row[i] & 0xff);
  }
}

template <class T>
std::vector<std::byte> encode(const Image<T>& image, int level) {
  TERRACAST_CHECK(image.channels() <= 4, "{} channels", image.channels());
  TERRACAST_CHECK(image.width() > 0 && image.height() > 0, "{}x{}", image.width(), image.height());
  TERRACAST_CHECK(level >= 1 && level <= 12, "level {}", level);
  const std::size_t pixel_bytes = sizeof(T) * static_cast<std::size_t>(image.channels());
  const std::size_t row_bytes = sizeof(T) * image.row_size();
  const auto height = static_cast<std::size_t>(image.height());

  // Not value-initialised: every byte is written below.
  const std::size_t filtered_bytes = (row_bytes + 1) * height;
  const std::unique_ptr<std::uint8_t[]> filtered(new std::uint8_t[filtered_bytes]);
  std::vector<std::uint8_t> rows(3 * row_bytes);
  std::uint8_t* row = rows.data();
  std::uint8_t* above = row + row_bytes;
  std::uint8_t* scratch = above + row_bytes;
  for (std::size_t y = 0; y < height; ++y) {
    serialise(image.row(static_cast<int>(y)), row);
    filter_row(row, y == 0 ? nullptr : above, row_bytes, pixel_bytes, scratch,
               filtered.get() + y * (row_bytes + 1));
    std::swap(row, above);
  }

  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), &libdeflate_free_compressor);
  if (compressor == nullptr) throw std::bad_alloc();
  const std::size_t bound = libdeflate_zlib_compress_bound(compressor.get(), filtered_bytes);
  const std::unique_ptr<std::byte[]> compressed(new std::byte[bound]);
  const std::size_t size = libdeflate_zlib_compress(compressor.get(), filtered.get(),
                                                    filtered_bytes, compressed.get(), bound);
  TERRACAST_CHECK(size > 0, "{} bytes do not fit the bound {}", filtered_bytes, bound);

  static constexpr unsigned char kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  std::vector<std::byte> out;
  out.reserve(size + 100);
  for (const unsigned char c : kSignature) out.push_back(static_cast<std::byte>(c));
  std::vector<std::byte> header;
  append_u32(header, static_cast<std::uint32_t>(image.width()));
  append_u32(header, static_cast<std::uint32_t>(image.height()));
  header.push_back(static_cast<std::byte>(8 * sizeof(T)));
  header.push_back(static_cast<std::byte>(color_type(image.channels())));
  header.insert(header.end(), 3, std::byte{0});  // deflate, the standard filters, not interlaced
  append_chunk(out, "IHDR", header);
  for (std::size_t begin = 0; begin < size; begin += kMaxChunkBytes)
    append_chunk(out, "IDAT", {compressed.get() + begin, std::min(kMaxChunkBytes, size - begin)});
  append_chunk(out, "IEND", {});
  return out;
}

// ---------------------------------------------------------------------------------------------
// Decoding. libpng leaves by longjmp, which must not pass over destructors: each call of it stands
// in a function of plain values alone, and what owns memory lives in the caller.

struct Reader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  const std::byte* bytes = nullptr;
  std::size_t size = 0;
  std::size_t offset = 0;
  char message[200] = {};

  Reader() = default;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

struct Size {
  std::size_t width = 0;
  std::size_t height = 0;
  std::size_t pixel_bits = 0;  ///< as stored
};

struct Layout {
  std::size_t channels = 0;
  std::size_t depth = 0;
  std::size_t row_bytes = 0;
};

[[noreturn]] void on_read_error(png_structp png, png_const_charp message) {
  auto* reader = static_cast<Reader*>(png_get_error_ptr(png));
  std::strncpy(reader->message, message, sizeof reader->message - 1);
  png_longjmp(png, 1);
  std::abort();  // not reached: png_longjmp does not return
}

void on_read_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep out, std::size_t count) {
  auto* reader = static_cast<Reader*>(png_get_io_ptr(png));
  if (count > reader->size - reader->offset) png_error(png, "it ends too early");
  std::memcpy(out, reader->bytes + reader->offset, count);
  reader->offset += count;
}

bool read_size(Reader& reader, Size& size) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, on_read);
  png_set_user_limits(reader.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_crc_action(reader.png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  // Texts, profiles and the like, which say nothing of the pixels, are passed over: by libpng's defaults up to
  // a thousand texts of 8 000 000 bytes are inflated and kept. Palettes and transparency are read.
  png_set_keep_unknown_chunks(reader.png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(reader.png, reader.info);
  size.width = png_get_image_width(reader.png, reader.info);
  size.height = png_get_image_height(reader.png, reader.info);
  size.pixel_bits = std::size_t{png_get_bit_depth(reader.png, reader.info)} *
                    png_get_channels(reader.png, reader.info);
  return true;
}

/// Takes memory for rows: what the file claims has to be checked before.
bool read_layout(Reader& reader, Layout& layout) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_expand(reader.png);  // palettes to RGB, 1 to 4 bits to 8, a transparent colour to alpha
  if constexpr (std::endian::native == std::endian::little) png_set_swap(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  layout.channels = png_get_channels(reader.png, reader.info);
  layout.depth = png_get_bit_depth(reader.png, reader.info);
  layout.row_bytes = png_get_rowbytes(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytep* rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

template <class T>
Image<T> read_image(Reader& reader, const Size& size, const Layout& layout,
                    const std::string& name) {
  Image<T> image(static_cast<int>(size.width), static_cast<int>(size.height),
                 static_cast<int>(layout.channels));
  TERRACAST_CHECK(layout.row_bytes == sizeof(T) * image.row_size(), "{}", layout.row_bytes);
  std::vector<png_bytep> rows(size.height);
  for (int y = 0; y < image.height(); ++y)
    rows[static_cast<std::size_t>(y)] = reinterpret_cast<png_bytep>(image.row(y).data());
  if (!read_rows(reader, rows.data()))
    fail(ErrorKind::Input, "{}: a damaged PNG: {}", name, reader.message);
  return image;
}

}  // namespace

std::vector<std::byte> encode_png(const Image8& image, int level) { return encode(image, level); }
std::vector<std::byte> encode_png(const Image16& image, int level) { return encode(image, level); }

std::variant<Image8, Image16> decode_png(std::span<const std::byte> bytes, const std::string& name,
                                         std::size_t max_pixels) {
  if (bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) != 0)
    fail(ErrorKind::Input, "{}: not a PNG (its first bytes say so)", name);
  Reader reader;
  reader.bytes = bytes.data();
  reader.size = bytes.size();
  reader.png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_read_error, on_read_warning);
  if (reader.png != nullptr) reader.info = png_create_info_struct(reader.png);
  if (reader.info == nullptr) throw std::bad_alloc();

  const auto refuse_damage = [&] {
    fail(ErrorKind::Input, "{}: a damaged PNG: {}", name, reader.message);
  };
  Size size;
  if (!read_size(reader, size)) refuse_damage();
  if (size.width > max_pixels / size.height)
    fail(ErrorKind::Input, "{}: {} x {} pixels are more than the {} allowed", name, size.width,
         size.height, max_pixels);
  // Deflate never shrinks more than 1032 times: what claims more than the file can hold is refused
  // before memory is taken for it. Rows of whole bytes and a filter byte each are left out, for a
  // bound that errs to the mild side.
  constexpr std::size_t kMaxGrowth = 1032;
  if (size.width * size.height / 8 / kMaxGrowth * size.pixel_bits > bytes.size())
    fail(ErrorKind::Input, "{}: a damaged PNG: {} bytes cannot hold {} x {} pixels", name,
         bytes.size(), size.width, size.height);
  Layout layout;
  if (!read_layout(reader, layout)) refuse_damage();
  if (layout.depth == 16) return read_image<std::uint16_t>(reader, size, layout, name);
  return read_image<std::uint8_t>(reader, size, layout, name);
}

}  // namespace terracast::core
