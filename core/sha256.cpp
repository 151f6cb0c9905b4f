#include "core/sha256.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::core {

namespace {

class Sha256 {
 public:
  Sha256() : state_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    TERRACAST_CHECK(state_ != nullptr &&
                    EVP_DigestInit_ex(state_.get(), EVP_sha256(), nullptr) == 1);
  }

  void add(std::span<const std::byte> bytes) {
    TERRACAST_CHECK(EVP_DigestUpdate(state_.get(), bytes.data(), bytes.size()) == 1);
  }

  std::string hexadecimal() {
    std::array<unsigned char, 32> digest{};
    unsigned size = 0;
    TERRACAST_CHECK(EVP_DigestFinal_ex(state_.get(), digest.data(), &size) == 1 &&
                    size == digest.size());
    std::string text;
    for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> state_;
};

void check_path(const std::string& path) {
  const char* wrong = nullptr;
  if (path.empty()) wrong = "is empty";
  if (path.starts_with('/')) wrong = "is absolute";
  if (path.find('\0') != std::string::npos) wrong = "holds a zero byte";
  if (path == "-") wrong = "stands for the input of sha256sum; call the file something else";
  if (wrong != nullptr)
    fail(ErrorKind::Input, "\"{}\" cannot be among checksums: it {}", path, wrong);
}

std::string escaped(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '\\')
      text += "\\\\";
    else if (c == '\n')
      text += "\\n";
    else if (c == '\r')
      text += "\\r";
    else
      text += c;
  }
  return text;
}

}  // namespace

std::string sha256(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.hexadecimal();
}

std::string sha256(std::string_view text) { return sha256(std::as_bytes(std::span(text))); }

std::string sha256_of_file(const std::filesystem::path& file) {
  Sha256 hash;
  read_file_blocks(file, [&](std::span<const std::byte> block) { hash.add(block); });
  return hash.hexadecimal();
}

std::string checksum_lines(std::vector<FileChecksum> files) {
  std::sort(files.begin(), files.end(),
            [](const FileChecksum& a, const FileChecksum& b) { return a.path < b.path; });
  std::string text;
  for (std::size_t i = 0; i < files.size(); ++i) {
    check_path(files[i].path);
    if (i > 0 && files[i].path == files[i - 1].path)
      fail(ErrorKind::Input, "\"{}\" is twice among checksums", files[i].path);
    const std::string name = escaped(files[i].path);
    text += fmt::format("{}{}  {}\n", name == files[i].path ? "" : "\\", files[i].sha256, name);
  }
  return text;
}

}  // namespace terracast::core
