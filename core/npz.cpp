#include "core/npz.h"

#include <zip.h>

#include <memory>

#include "core/error.h"

namespace terracast::core {
namespace {

/// 1980-01-01, the first day a zip can hold, as MS-DOS counts.
constexpr zip_uint16_t kFirstDay = (0 << 9) | (1 << 5) | 1;

std::string message_of(zip_error_t* error) {
  std::string text = zip_error_strerror(error);
  zip_error_fini(error);
  return text;
}

}  // namespace

std::vector<std::byte> npz_bytes(const std::vector<NpzArray>& arrays) {
  zip_error_t error;
  zip_error_init(&error);
  // The archive is built in this source's memory; kept once more, it outlives the archive that
  // takes it over.
  const std::unique_ptr<zip_source_t, void (*)(zip_source_t*)> memory(
      zip_source_buffer_create(nullptr, 0, 0, &error), zip_source_free);
  if (!memory) fail(ErrorKind::Internal, "npz: {}", message_of(&error));
  zip_t* archive = zip_open_from_source(memory.get(), ZIP_TRUNCATE, &error);
  if (archive == nullptr) fail(ErrorKind::Internal, "npz: {}", message_of(&error));
  zip_source_keep(memory.get());
  for (const NpzArray& array : arrays) {
    zip_source_t* content = zip_source_buffer(archive, array.npy.data(), array.npy.size(), 0);
    const std::string name = array.name + ".npy";
    const zip_int64_t index =
        content == nullptr ? -1 : zip_file_add(archive, name.c_str(), content, ZIP_FL_ENC_UTF_8);
    if (index < 0 ||
        zip_set_file_compression(archive, static_cast<zip_uint64_t>(index),
                                 array.is_deflated ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 1) != 0 ||
        zip_file_set_dostime(archive, static_cast<zip_uint64_t>(index), 0, kFirstDay, 0) != 0) {
      const std::string text = zip_strerror(archive);
      if (index < 0) zip_source_free(content);
      zip_discard(archive);
      fail(ErrorKind::Internal, "npz: {}: {}", name, text);
    }
  }
  if (zip_close(archive) != 0) {
    const std::string text = zip_strerror(archive);
    zip_discard(archive);
    fail(ErrorKind::Internal, "npz: {}", text);
  }
  zip_stat_t stat;
  std::vector<std::byte> bytes;
  bool is_read = zip_source_stat(memory.get(), &stat) == 0 && (stat.valid & ZIP_STAT_SIZE) != 0 &&
                 zip_source_open(memory.get()) == 0;
  if (is_read) {
    bytes.resize(stat.size);
    is_read = zip_source_read(memory.get(), bytes.data(), stat.size) ==
              static_cast<zip_int64_t>(stat.size);
    zip_source_close(memory.get());
  }
  if (!is_read) fail(ErrorKind::Internal, "npz: {}", message_of(zip_source_error(memory.get())));
  return bytes;
}

}  // namespace terracast::core
