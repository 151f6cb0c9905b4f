#include "world/deflated.h"

#include <libdeflate.h>

#include <memory>

#include "core/error.h"

namespace terracast::world {
namespace {

constexpr int kDeflateLevel = 6;

}  // namespace

std::uint32_t append_deflated(std::vector<std::byte>& bytes, std::span<const std::uint8_t> raw) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kDeflateLevel), libdeflate_free_compressor);
  TERRACAST_CHECK(compressor != nullptr, "no memory for a compressor");
  const std::size_t begin = bytes.size();
  bytes.resize(begin + libdeflate_deflate_compress_bound(compressor.get(), raw.size()));
  const std::size_t size = libdeflate_deflate_compress(compressor.get(), raw.data(), raw.size(),
                                                       bytes.data() + begin, bytes.size() - begin);
  TERRACAST_CHECK(size > 0, "deflate needs more than its bound");
  bytes.resize(begin + size);
  return static_cast<std::uint32_t>(size);
}

std::vector<std::uint8_t> inflated(std::span<const std::byte> deflated, std::size_t num_bytes,
                                   const std::string& file) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>
      decompressor(libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  TERRACAST_CHECK(decompressor != nullptr, "no memory for a decompressor");
  std::vector<std::uint8_t> raw(num_bytes);
  std::size_t used = 0;
  const libdeflate_result result = libdeflate_deflate_decompress_ex(
      decompressor.get(), deflated.data(), deflated.size(), raw.data(), raw.size(), &used, nullptr);
  if (result != LIBDEFLATE_SUCCESS || used != deflated.size())
    core::fail(core::ErrorKind::Input,
               "{}: a layer does not inflate to {} bytes; tile the world again", file, num_bytes);
  return raw;
}

}  // namespace terracast::world
