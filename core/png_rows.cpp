#include "core/png_rows.h"

#include <png.h>

#include <cstdlib>
#include <cstring>
#include <new>

#include "core/error.h"

namespace terracast::core {
namespace {

/// Of compressed bytes that libpng gathers for a chunk.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

// libpng leaves by longjmp, which must not pass over destructors: each call of it stands in a function of plain
// values alone, and what owns memory lives in the caller.
struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::byte>* bytes = nullptr;
  bool lacks_memory = false;
  char message[200] = {};

  Writer() = default;
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
};

[[noreturn]] void on_write_error(png_structp png, png_const_charp message) {
  auto* writer = static_cast<Writer*>(png_get_error_ptr(png));
  std::strncpy(writer->message, message, sizeof writer->message - 1);
  png_longjmp(png, 1);
  std::abort();  // not reached: png_longjmp does not return
}

void on_write_warning(png_structp, png_const_charp) {}

/// Whether there was memory for them.
bool append(std::vector<std::byte>& bytes, const png_byte* data, std::size_t count) {
  try {
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + count);
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

void on_write(png_structp png, png_bytep data, std::size_t count) {
  auto* writer = static_cast<Writer*>(png_get_io_ptr(png));
  if (append(*writer->bytes, data, count)) return;
  writer->lacks_memory = true;
  png_error(png, "no memory");
}

void on_flush(png_structp) {}

bool write_head(Writer& writer, png_uint_32 width, png_uint_32 height, int level) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_write_fn(writer.png, &writer, on_write, on_flush);
  png_set_user_limits(writer.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_compression_level(writer.png, level);
  png_set_compression_buffer_size(writer.png, kChunkBytes);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
  png_set_IHDR(writer.png, writer.info, width, height, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  png_write_info(writer.png, writer.info);
  return true;
}

bool write_row(Writer& writer, const png_byte* row) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_write_row(writer.png, row);
  return true;
}

bool write_end(Writer& writer) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_write_end(writer.png, nullptr);
  return true;
}

}  // namespace

std::vector<std::byte> encode_png_rows(
    int width, int height, const std::function<void(int y, std::span<std::uint8_t> row)>& fill_row,
    int level) {
  TERRACAST_CHECK(width > 0 && height > 0, "{}x{}", width, height);
  TERRACAST_CHECK(level >= 1 && level <= 9, "level {}", level);
  std::vector<std::byte> bytes;
  Writer writer;
  writer.bytes = &bytes;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_write_error, on_write_warning);
  if (writer.png != nullptr) writer.info = png_create_info_struct(writer.png);
  if (writer.info == nullptr) throw std::bad_alloc();

  const auto ensure = [&](bool was_written) {
    if (was_written) return;
    if (writer.lacks_memory) throw std::bad_alloc();
    fail(ErrorKind::Internal, "a PNG of {} x {} pixels cannot be written: {}", width, height,
         writer.message);
  };
  ensure(
      write_head(writer, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), level));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    fill_row(y, row);
    ensure(write_row(writer, row.data()));
  }
  ensure(write_end(writer));
  return bytes;
}

}  // namespace terracast::core
