#include "tiler/objects/model_folder.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>

#include "core/error.h"
#include "core/stop.h"
#include "tiler/objects/model_file.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// A file that ends where a stop is asked for: assimp's callbacks may not throw.
class StoppableFile final : public Assimp::IOStream {
 public:
  explicit StoppableFile(Assimp::IOStream* file) : file_(file) {}

  std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
    return core::stop_asked() ? 0 : file_->Read(buffer, size, count);
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    return file_->Seek(offset, origin);
  }
  std::size_t Tell() const override { return file_->Tell(); }
  std::size_t FileSize() const override { return file_->FileSize(); }
  void Flush() override {}

 private:
  std::unique_ptr<Assimp::IOStream> file_;
};

}  // namespace

std::vector<std::byte> bytes_of(const std::filesystem::path& file, const std::string& name) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail(ErrorKind::Io, "{}: no such file", name);
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) fail(ErrorKind::Io, "{}: cannot be read", name);
  if (size > kMostModelBytes)
    fail(ErrorKind::Input, "{}: {} bytes, and a model has at most {}", name, size, kMostModelBytes);
  std::vector<std::byte> bytes(size);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) fail(ErrorKind::Io, "{}: cannot be read", name);
  return bytes;
}

bool ModelFolder::Exists(const char* file) const {
  return is_inside(file) && Assimp::DefaultIOSystem::Exists(file);
}

Assimp::IOStream* ModelFolder::Open(const char* file, const char* mode) {
  if (std::strchr(mode, 'w') != nullptr || std::strchr(mode, 'a') != nullptr || !is_inside(file))
    return nullptr;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    if (obj_ != nullptr) missing_.insert(std::filesystem::path(file).lexically_normal());
    return nullptr;
  }
  opened_bytes_ += std::filesystem::file_size(file, error);
  if (opened_bytes_ > kMostModelBytes || !is_library_right(file)) return nullptr;
  Assimp::IOStream* opened = Assimp::DefaultIOSystem::Open(file, mode);
  return opened == nullptr ? nullptr : new StoppableFile(opened);
}

void ModelFolder::check(const std::string& model) const {
  core::throw_if_stop_asked();
  if (refused_) std::rethrow_exception(refused_);
  if (!escaped_.empty())
    fail(ErrorKind::Input, "{}: \"{}\" leads out of the model's folder; copy what it names there",
         model, escaped_);
  if (opened_bytes_ > kMostModelBytes)
    fail(ErrorKind::Input, "{}: it and what it names hold more than {} bytes", model,
         kMostModelBytes);
}

std::int64_t ModelFolder::num_missing() const {
  // Where a library is missing assimp looks for one of the model's own name.
  std::filesystem::path beside_it = model_;
  beside_it.replace_extension(".mtl");
  const auto num = static_cast<std::int64_t>(missing_.size());
  return num > 1 && missing_.contains(beside_it.lexically_normal()) ? num - 1 : num;
}

bool ModelFolder::is_inside(const char* file) const {
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(file, error);
  const auto [end, ignored] =
      std::mismatch(folder_.begin(), folder_.end(), whole.begin(), whole.end());
  if (end == folder_.end()) return true;
  escaped_ = file;
  return false;
}

bool ModelFolder::is_library_right(const char* file) {
  std::error_code error;
  if (obj_ == nullptr || std::filesystem::equivalent(file, model_, error)) return true;
  try {
    const std::filesystem::path path = file;
    const std::string name =
        std::filesystem::weakly_canonical(path).lexically_relative(folder_).generic_string();
    obj_->look_at_library(bytes_of(path, name), name);
    return true;
  } catch (const core::Error&) {  // told in check()
    refused_ = std::current_exception();
    return false;
  }
}

}  // namespace terracast::tiler
