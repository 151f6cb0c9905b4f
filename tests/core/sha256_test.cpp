#include "core/sha256.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/program.h"
#include "core/random.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

using testing::HasSubstr;

// FIPS 180-4's examples, as NIST publishes them.
constexpr const char* kEmpty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
constexpr const char* kAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr const char* kTwoBlocks =
    "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1";
constexpr const char* kMillion = "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";

TEST(Sha256Test, MatchesPublishedValues) {
  EXPECT_EQ(sha256(""), kEmpty);
  EXPECT_EQ(sha256("abc"), kAbc);
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"), kTwoBlocks);
  EXPECT_EQ(sha256(std::string(1000000, 'a')), kMillion);
}

TEST(Sha256Test, AFileIsItsBytes) {
  const test::ScratchFolder folder;
  write_file(folder / "empty", std::string_view());
  write_file(folder / "abc", std::string_view("abc"));
  write_file(folder / "million", std::string(1000000, 'a'));
  EXPECT_EQ(sha256_of_file(folder / "empty"), kEmpty);
  EXPECT_EQ(sha256_of_file(folder / "abc"), kAbc);
  EXPECT_EQ(sha256_of_file(folder / "million"), kMillion);
}

TEST(Sha256Test, UnreadableFilesAreErrorsThatNameThem) {
  const test::ScratchFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto kind_of = [](const std::filesystem::path& file) {
    try {
      sha256_of_file(file);
    } catch (const Error& error) {
      EXPECT_THAT(error.message(), HasSubstr(file.string()));
      return error.kind();
    }
    return ErrorKind::Internal;
  };
  EXPECT_EQ(kind_of(folder / "gone"), ErrorKind::Io);
  EXPECT_EQ(kind_of(folder.path()), ErrorKind::Io);
  EXPECT_EQ(kind_of(folder / "pipe"), ErrorKind::Input);
}

/// Names that shells, GNU's escapes and its older formats may trip over.
const std::vector<std::string> kNames = {
    "plain.png", "with blank",  " before",        "after ",         "*starred", "-dashed",
    "#remark",   "back\\slash", "line\nfeed",     "carriage\rback", "\\n",      "tab\tin",
    "umläut",    "not\xffutf8", "in/folders/c d", "SHA256 (x) = y"};

struct Checked {
  int status = -1;
  std::string output;
};

/// What the program itself says of a list, from within its folder.
Checked run_sha256sum(const test::ScratchFolder& folder) {
  std::filesystem::remove(folder / "log");
  const ProgramEnd end = run_program(
      "/usr/bin/env",
      {"-C", (folder / "dataset").string(), "sha256sum", "--check", "--strict", "SHA256SUMS"},
      folder / "log", {.timeout_s = 60.0, .environment = {"LC_ALL=C"}});
  return {end.kind == ProgramEnd::Kind::Exited ? end.status : -1, read_text_file(folder / "log")};
}

struct ChecksumLines : testing::Test {
  test::ScratchFolder folder;

  void SetUp() override {
    std::vector<FileChecksum> files;
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      const std::filesystem::path file = folder / "dataset" / kNames[i];
      std::string bytes(1000 * i, '\0');
      for (std::size_t k = 0; k < bytes.size(); ++k)
        bytes[k] = static_cast<char>(random_bits(1, i, k));
      write_file(file, bytes);
      files.push_back({kNames[i], sha256_of_file(file)});
    }
    write_file(folder / "dataset/SHA256SUMS", checksum_lines(files));
  }
};

TEST_F(ChecksumLines, AreReadBySha256sum) {
  const Checked checked = run_sha256sum(folder);
  EXPECT_EQ(checked.status, 0) << checked.output;
  EXPECT_EQ(std::count(checked.output.begin(), checked.output.end(), '\n'),
            static_cast<std::ptrdiff_t>(kNames.size()))
      << checked.output;
}

TEST_F(ChecksumLines, AreThoseThatSha256sumWrites) {
  std::vector<std::string> names = kNames;
  std::sort(names.begin(), names.end());
  std::vector<std::string> arguments = {"-C", (folder / "dataset").string(), "sha256sum", "--"};
  arguments.insert(arguments.end(), names.begin(), names.end());
  ASSERT_TRUE(run_program("/usr/bin/env", arguments, folder / "log").is_success());
  EXPECT_EQ(read_text_file(folder / "log"), read_text_file(folder / "dataset/SHA256SUMS"));
}

TEST_F(ChecksumLines, ShowADamagedFileAndAMissingOne) {
  std::string bytes = read_text_file(folder / "dataset/line\nfeed");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write_file(folder / "dataset/line\nfeed", bytes);
  std::filesystem::remove(folder / "dataset/umläut");
  const Checked checked = run_sha256sum(folder);
  EXPECT_EQ(checked.status, 1);
  EXPECT_THAT(checked.output, HasSubstr("\\line\\nfeed: FAILED\n"));
  EXPECT_THAT(checked.output, HasSubstr("1 computed checksum did NOT match"));
  EXPECT_THAT(checked.output, HasSubstr("1 listed file could not be read"));
}

TEST(ChecksumNames, ThatCannotBeCheckedAreRefused) {
  const auto message_of = [](std::vector<FileChecksum> files) {
    try {
      return checksum_lines(std::move(files));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Input);
      return error.message();
    }
  };
  EXPECT_THAT(message_of({{"-", kAbc}}), HasSubstr("input of sha256sum"));
  EXPECT_THAT(message_of({{"", kAbc}}), HasSubstr("empty"));
  EXPECT_THAT(message_of({{"/etc/passwd", kAbc}}), HasSubstr("absolute"));
  EXPECT_THAT(message_of({{std::string("a\0b", 3), kAbc}}), HasSubstr("zero byte"));
  EXPECT_THAT(message_of({{"a", kAbc}, {"b", kAbc}, {"a", kAbc}}), HasSubstr("twice"));
}

TEST(ChecksumNames, AreSortedWhateverTheirOrder) {
  EXPECT_EQ(checksum_lines({{"b", kAbc}, {"a", kEmpty}}),
            checksum_lines({{"a", kEmpty}, {"b", kAbc}}));
  EXPECT_EQ(checksum_lines({}), "");
}

}  // namespace
}  // namespace terracast::core
