#include "core/atomic_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

template <class Work>
std::string error_of(Work&& work, ErrorKind kind) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// Runs `work` in a child; returns waitpid()'s status.
template <class Work>
int status_of_child(Work&& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    ::_exit(0);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return status;
}

TEST(AtomicFileTest, WritesAndReadsWholeFiles) {
  const test::ScratchFolder folder;
  std::string text(300000, '\0');
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>(random_bits(1, 2, i));
  const fs::path file = folder / "new/folder/a.bin";
  for (const std::string& content : {text, std::string(), std::string("x")}) {
    write_file(file, content);
    EXPECT_EQ(read_text_file(file), content);
    const std::vector<std::byte> bytes = read_file(file);
    EXPECT_EQ(bytes.size(), content.size());
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), std::as_bytes(std::span(content)).begin()));
  }
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("a.bin", "folder", "new"));
}

TEST(AtomicFileTest, FilesHaveTheUsualPermissions) {
  const test::ScratchFolder folder;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  write_file(folder / "a", "x");
  struct stat status {};
  ASSERT_EQ(::stat((folder / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0666U & ~mask);
}

TEST(AtomicFileTest, LibrariesGetATemporaryOfTheSameExtension) {
  const test::ScratchFolder folder;
  fs::path seen;
  write_file_by(folder / "a.tif", [&](const fs::path& temporary) {
    seen = temporary;
    std::ofstream(temporary) << "content";
  });
  EXPECT_EQ(seen.extension(), ".tif");
  EXPECT_EQ(seen.parent_path(), folder.path());
  EXPECT_EQ(read_text_file(folder / "a.tif"), "content");
  EXPECT_FALSE(fs::exists(seen));

  EXPECT_THROW(write_file_by(folder / "a.tif",
                             [&](const fs::path& temporary) {
                               std::ofstream(temporary) << "half";
                               throw std::runtime_error("stopped");
                             }),
               std::runtime_error);
  EXPECT_EQ(read_text_file(folder / "a.tif"), "content");
  EXPECT_THAT(
      error_of([&] { write_file_by(folder / "b.tif", [](const fs::path&) {}); }, ErrorKind::Io),
      HasSubstr("b.tif: its writer left no file"));
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("a.tif"));
}

TEST(AtomicFileTest, FailuresNameFileAndReason) {
  const test::ScratchFolder folder;
  write_file(folder / "file", "x");
  EXPECT_THAT(error_of([&] { write_file(folder / "file/below", "x"); }, ErrorKind::Io),
              HasSubstr("file: "));
  fs::create_directory(folder / "folder");
  EXPECT_THAT(error_of([&] { write_file(folder / "folder", "x"); }, ErrorKind::Io),
              HasSubstr("Is a directory"));
  EXPECT_THAT(error_of([&] { read_file(folder / "gone"); }, ErrorKind::Io),
              HasSubstr("gone: cannot be read: No such file or directory"));
  EXPECT_THAT(error_of([&] { read_file(folder / "folder"); }, ErrorKind::Io),
              HasSubstr("is a folder"));
  EXPECT_THAT(error_of([&] { make_folder(folder / "file"); }, ErrorKind::Io), HasSubstr("file"));
  EXPECT_THAT(error_of([&] { write_file("/proc/terracast", "x"); }, ErrorKind::Io),
              HasSubstr("/proc/terracast: cannot be written"));
  EXPECT_THAT(error_of([&] { write_file("", "x"); }, ErrorKind::Io), HasSubstr("name a file"));
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("file", "folder"));
}

TEST(AtomicFileTest, SizeLimitsHold) {
  const test::ScratchFolder folder;
  write_file(folder / "a", "12345");
  EXPECT_EQ(read_text_file(folder / "a", 5), "12345");
  EXPECT_THAT(error_of([&] { read_text_file(folder / "a", 4); }, ErrorKind::Input),
              HasSubstr("larger than 4 bytes"));
  EXPECT_FALSE(read_text_file("/proc/self/status").empty());
}

// Seen in 2026: reading a pipe waited for ever; writing to one put a file in its place.
TEST(AtomicFileTest, DevicesAndPipesAreRefusedAndStay) {
  const test::ScratchFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(error_of([&] { read_file(folder / "pipe"); }, ErrorKind::Input),
              HasSubstr("pipe: is a device or pipe"));
  EXPECT_THAT(error_of([&] { read_file("/dev/zero", 100000); }, ErrorKind::Input),
              HasSubstr("/dev/zero: is a device"));
  EXPECT_THAT(error_of([&] { write_file(folder / "pipe", "x"); }, ErrorKind::Io),
              HasSubstr("pipe: a device or pipe"));
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
}

TEST(AtomicFileTest, LinksAreWrittenThrough) {
  const test::ScratchFolder folder;
  fs::create_directory(folder / "far");
  write_file(folder / "far/old", "old");
  fs::create_symlink("far/old", folder / "link");
  fs::create_symlink("link", folder / "second");
  fs::create_symlink(folder / "far/new", folder / "dangling");
  fs::create_symlink("loop", folder / "loop");
  write_file(folder / "second", "x");
  write_file(folder / "dangling", "y");
  EXPECT_EQ(read_text_file(folder / "far/old"), "x");
  EXPECT_EQ(read_text_file(folder / "far/new"), "y");
  for (const char* link : {"link", "second", "dangling"})
    EXPECT_TRUE(fs::is_symlink(folder / link)) << link;
  EXPECT_THAT(error_of([&] { write_file(folder / "loop", "x"); }, ErrorKind::Io),
              HasSubstr("too many links"));
}

TEST(AtomicFileTest, AFullDiskIsAnErrorAndLeavesTheOldFile) {
  // A limit on the size of files fails in write() as a full disk does, after a part was written.
  const test::ScratchFolder folder;
  write_file(folder / "a", "old");
  const int status = status_of_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100000, 100000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_file(folder / "a", std::string(1000000, 'x'));
    } catch (const Error& error) {
      const bool told = error.message().find("cannot be written after 100000 of 1000000 bytes") !=
                        std::string::npos;
      ::_exit(error.kind() == ErrorKind::Io && told ? 42 : 1);
    }
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 42);
  EXPECT_EQ(read_text_file(folder / "a"), "old");
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("a"));
}

TEST(AtomicFileTest, ReadersOfAFileThatManyWriteSeeWholeOnes) {
  const test::ScratchFolder folder;
  const fs::path file = folder / "shared";
  write_file(file, std::string(50000, 'a'));
  std::vector<pid_t> children;
  for (char letter = 'a'; letter < 'd'; ++letter) {
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        for (int i = 0; i < 30; ++i) write_file(file, std::string(50000, letter));
      } catch (...) {
        ::_exit(1);
      }
      ::_exit(0);
    }
    children.push_back(child);
  }
  for (int i = 0; i < 200; ++i) {
    const std::string text = read_text_file(file);
    ASSERT_EQ(text, std::string(50000, text.at(0)));
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("shared"));
}

TEST(AtomicFileTest, OneOfManyWritersOfANewFileIsTheFirst) {
  const test::ScratchFolder folder;
  for (int round = 0; round < 20; ++round) {
    const fs::path file = folder / std::to_string(round);
    const fs::path start = folder / ("start" + std::to_string(round));
    std::vector<pid_t> writers;
    for (int writer = 0; writer < 6; ++writer) {
      const pid_t child = ::fork();
      if (child == 0) {
        try {
          while (!fs::exists(start)) std::this_thread::yield();
          ::_exit(write_new_file(file, std::string(5000, static_cast<char>('a' + writer))) ? 1 : 0);
        } catch (...) {
          ::_exit(2);
        }
      }
      writers.push_back(child);
    }
    write_file(start, "");
    std::string first;
    for (std::size_t i = 0; i < writers.size(); ++i) {
      int status = 0;
      ::waitpid(writers[i], &status, 0);
      ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2) << status;
      if (WEXITSTATUS(status) == 1) first += static_cast<char>('a' + i);
    }
    ASSERT_EQ(first.size(), 1U) << "writers that were told to be the first: " << first;
    EXPECT_EQ(read_text_file(file), std::string(5000, first[0]));
    fs::remove(start);
  }
  EXPECT_EQ(names_in(folder.path()).size(), 20U);  // no temporaries are left
  EXPECT_FALSE(write_new_file(folder / "0", "later"));
  EXPECT_EQ(read_text_file(folder / "0").size(), 5000U);
  EXPECT_TRUE(write_new_file(folder / "new/folder/file", ""));
  EXPECT_EQ(read_text_file(folder / "new/folder/file"), "");
}

TEST(AtomicFileTest, TemporariesOfTheKilledGoAndOthersStay) {
  const test::ScratchFolder folder;
  // A child that is killed in the middle of writing leaves its temporary file.
  fs::create_directories(folder / "sub");
  const int status = status_of_child([&] {
    write_file_by(folder / "sub/a.png", [](const fs::path& temporary) {
      std::ofstream(temporary) << "half";
      ::raise(SIGKILL);
    });
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_EQ(names_in(folder.path()).size(), 2U);
  write_file(folder / "keep.png", "x");

  // What a living process (this one) is writing stays, here and in the other's folder.
  write_file_by(folder / "mine.png", [&](const fs::path& temporary) {
    std::ofstream(temporary) << "mine";
    remove_temporaries(folder.path());
    EXPECT_TRUE(fs::exists(temporary));
  });
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("keep.png", "mine.png", "sub"));

  // A writer on another machine is given an hour.
  const fs::path foreign = folder / "sub/.terracast-tmp-01234567-1-5-0123456789abcdef.png";
  std::ofstream(foreign) << "x";
  remove_temporaries(folder.path());
  EXPECT_TRUE(fs::exists(foreign));
  fs::last_write_time(foreign, fs::file_time_type::clock::now() - std::chrono::hours(2));
  remove_temporaries(folder.path());
  EXPECT_FALSE(fs::exists(foreign));

  // Odd names of the same prefix must not break it.
  for (const char* name : {".terracast-tmp-", ".terracast-tmp-0", ".terracast-tmp-01234567",
                           ".terracast-tmp-01234567-", ".terracast-tmp-x-y-z"})
    std::ofstream(folder / name) << "x";
  EXPECT_NO_THROW(remove_temporaries(folder.path()));
  EXPECT_NO_THROW(remove_temporaries(folder / "gone"));
}

TEST(AtomicFileTest, ManyMayWriteAndClearOneFolderAtOnce) {
  const test::ScratchFolder folder;
  std::vector<pid_t> children;
  for (int writer = 0; writer < 4; ++writer) {
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        for (int i = 0; i < 60; ++i) {
          if (i % 10 == 7) {  // what a writer left that was killed, and all want to remove
            const fs::path left =
                folder / fmt::format("sub/.terracast-tmp-01234567-1-5-{}.png", 60 * writer + i);
            std::ofstream(left) << "half";
            std::error_code gone;
            fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(2),
                                gone);
          }
          write_file(folder / "sub" / std::to_string(i % 30), std::string(20000, 'x'));
          remove_temporaries(folder.path());
        }
      } catch (...) {
        ::_exit(1);
      }
      ::_exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  for (int i = 0; i < 30; ++i) EXPECT_EQ(fs::file_size(folder / "sub" / std::to_string(i)), 20000U);
  remove_temporaries(folder.path());
  EXPECT_EQ(names_in(folder.path()).size(), 31U);
}

TEST(AtomicFileTest, ALinkedFileIsTheSameFileAndReplacesWhatStoodThere) {
  const test::ScratchFolder folder;
  write_file(folder / "a.png", "new");
  write_file(folder / "there/b.png", "old");
  // The second time both names are links to one file already.
  for (int i = 0; i < 2; ++i) {
    link_file(folder / "a.png", folder / "there/b.png");
    EXPECT_EQ(read_text_file(folder / "there/b.png"), "new");
    EXPECT_TRUE(fs::equivalent(folder / "a.png", folder / "there/b.png"));
    EXPECT_THAT(names_in(folder / "there"), testing::ElementsAre("b.png"));
  }
  // What is written later goes to one of them alone.
  write_file(folder / "a.png", "newer");
  EXPECT_EQ(read_text_file(folder / "there/b.png"), "new");
  link_file(folder / "a.png", folder / "made/c.png");
  EXPECT_EQ(read_text_file(folder / "made/c.png"), "newer");

  try {
    link_file(folder / "missing.png", folder / "d.png");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Io);
    EXPECT_THAT(error.what(), testing::HasSubstr("missing.png"));
  }
  EXPECT_FALSE(fs::exists(folder / "d.png"));
}

TEST(AtomicFileTest, WhereNoLinkCanBeAFileIsCopied) {
  const test::ScratchFolder folder;
  const fs::path elsewhere =
      fs::path("/dev/shm") / ("terracast-link-test-" + std::to_string(::getpid()));
  struct stat here {};
  struct stat there {};
  if (::stat(folder.path().c_str(), &here) != 0 || ::stat("/dev/shm", &there) != 0 ||
      here.st_dev == there.st_dev)
    GTEST_SKIP() << "there is only one file system to write to";
  write_file(elsewhere / "a.png", "content");
  link_file(elsewhere / "a.png", folder / "b.png");
  EXPECT_EQ(read_text_file(folder / "b.png"), "content");
  EXPECT_FALSE(fs::equivalent(elsewhere / "a.png", folder / "b.png"));
  EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("b.png"));
  fs::remove_all(elsewhere);
}

TEST(AtomicFileTest, LongNamesAreWritten) {
  const test::ScratchFolder folder;
  const std::string name = std::string(251, 'n') + ".png";
  write_file(folder / name, "x");
  EXPECT_EQ(read_text_file(folder / name), "x");
}

}  // namespace
}  // namespace terracast::core
