#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/error.h"
#include "base/output_file.h"
#include "tests/support/tests.h"

namespace tessera::output_file_test {
namespace {

std::set<std::string> files_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

void write_output(const fs::path& target, std::string_view bytes) {
  OutputFile file(target);
  file.write(bytes);
  file.commit();
}

// Message of the refusal, or "" without one.
std::string refusal(const std::function<void()>& check) {
  try {
    check();
    return "";
  } catch (const UsageError& error) {
    return error.what();
  }
}

void make_socket(const fs::path& path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  path.string().copy(name.sun_path, sizeof name.sun_path - 1);
  const int end = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(end, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ::close(end);
}

// Both ends of a pipe.
struct Pipe {
  Pipe() { EXPECT_EQ(::pipe(ends), 0); }
  ~Pipe() {
    for (const int end : ends)
      if (end >= 0) ::close(end);
  }
  std::string name(int end) const { return "/dev/fd/" + std::to_string(ends[end]); }
  int ends[2] = {-1, -1};
};

// Invariant A1.
TEST(AtomicFile, ReplacesNothingButARegularFile) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  make_socket(folder / "socket");
  fs::create_directory(folder / "folder");
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  const std::set<std::string> before = files_in(folder.path());
  for (const std::string& name : before) EXPECT_THROW(write_file_atomically(folder / name, "x"), WriteError) << name;
  EXPECT_EQ(files_in(folder.path()), before);
  EXPECT_TRUE(fs::is_fifo(folder / "fifo"));
  EXPECT_TRUE(fs::is_socket(folder / "socket"));
  EXPECT_TRUE(fs::is_symlink(folder / "a"));
  // A fifo that appears at the path while the file is written stays as well.
  AtomicFile file(folder / "late");
  file.write("x");
  ASSERT_EQ(::mkfifo((folder / "late").c_str(), 0600), 0);
  EXPECT_THROW(file.commit(), WriteError);
  EXPECT_TRUE(fs::is_fifo(folder / "late"));
}

// Invariant A2.
TEST(AtomicFile, ASymlinkStaysAndTheFileAtItsEndIsReplaced) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder / "there");
  test::write_text(folder / "there" / "file", "old");
  fs::create_symlink("there/file", folder / "link");
  fs::create_symlink("link", folder / "second");
  fs::create_symlink("there/new", folder / "dangling");
  write_file_atomically(folder / "second", "one");
  write_output(folder / "dangling", "two");
  EXPECT_EQ(test::read_text(folder / "there" / "file"), "one");
  EXPECT_EQ(test::read_text(folder / "there" / "new"), "two");
  for (const char* link : {"link", "second", "dangling"}) EXPECT_TRUE(fs::is_symlink(folder / link)) << link;
  EXPECT_EQ(files_in(folder / "there"), (std::set<std::string>{"file", "new"}));
}

// Invariant O1.
TEST(OutputFile, RefusesOtherFileTypesAndMakesNothing) {
  const test::TemporaryFolder folder;
  make_socket(folder / "socket");
  fs::create_directory(folder / "folder");
  test::write_text(folder / "file", "x");
  fs::create_symlink("loop", folder / "loop");
  fs::create_symlink("no/such", folder / "dangling");
  const Pipe pipe;
  const std::vector<std::pair<fs::path, const char*>> refused = {
      {folder / "socket", "is a socket"},
      {folder / "folder", "is a folder"},
      {folder / "folder" / "", "is a folder"},
      {folder / "loop", "is a loop of symlinks"},
      {folder / "dangling", "is missing"},
      {folder / "no" / "such", "no is missing"},
      {folder / "file" / "x", "file is not a folder"},
      {"/dev/fd/987654", "no such descriptor is open"},
      {pipe.name(0), "reading only"},
  };
  const std::set<std::string> before = files_in(folder.path());
  for (const auto& each : refused) {
    const auto& target = each.first;
    const auto& why = each.second;
    EXPECT_THAT(refusal([&] { check_output_file(target); }), HasSubstr(why)) << target;
    EXPECT_THAT(refusal([&] { OutputFile file(target); }), HasSubstr(why)) << target;
  }
  EXPECT_EQ(files_in(folder.path()), before);
  EXPECT_EQ(test::read_text(folder / "file"), "x");
  // The folder that the command makes, with those before it, is not missing.
  for (const char* made : {"no", "no/deep", "no/deep/er"})
    EXPECT_EQ(refusal([&] { check_output_file(folder / "no" / "such", folder / made); }), "") << made;
  EXPECT_NE(refusal([&] { check_output_file(folder / "no" / "such", folder / "nor"); }), "");
}

// Invariant O2.
TEST(OutputFile, WritesAFifoThrough) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  fs::create_symlink("fifo", folder / "link");
  const int reader = ::open((folder / "fifo").c_str(), O_RDWR);
  for (const char* name : {"fifo", "link"}) {
    EXPECT_TRUE(is_stream(folder / name));
    write_output(folder / name, "whole");
    char bytes[8] = {};
    EXPECT_EQ(::read(reader, bytes, sizeof bytes), 5);
    EXPECT_STREQ(bytes, "whole");
  }
  ::close(reader);
  EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"fifo", "link"}));
  EXPECT_TRUE(fs::is_fifo(folder / "fifo"));
}

TEST(OutputFile, WritesADescriptorUnderAnyNameAtItsOffset) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "file", "before,");
  const int file = ::open((folder / "file").c_str(), O_WRONLY | O_APPEND);
  fs::create_symlink("/dev/fd/" + std::to_string(file), folder / "link");
  for (const std::string& name :
       {"/dev/fd/" + std::to_string(file), "/proc/self/fd/" + std::to_string(file), (folder / "link").string()}) {
    EXPECT_EQ(named_descriptor(name), file) << name;
    write_output(name, "more,");
  }
  EXPECT_EQ(::close(file), 0);
  EXPECT_EQ(test::read_text(folder / "file"), "before,more,more,more,");
  EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"file", "link"}));
  EXPECT_EQ(named_descriptor("/dev/stdout"), 1);
  for (const char* name : {"/dev/null", "/dev/fd", "/dev/fd/", "/dev/fd/x", "/dev/fd/-1", "/dev/fd/3x", "3", ""})
    EXPECT_EQ(named_descriptor(name), std::nullopt) << name;
}

TEST(OutputFile, AReaderThatWentAwayIsAnErrorNotASignal) {
  Pipe pipe;
  OutputFile file(pipe.name(1));
  ::close(std::exchange(pipe.ends[0], -1));
  file.write("x");
  try {
    file.commit();
    FAIL();
  } catch (const WriteError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Broken pipe"));
  }
}

TEST(OutputFile, ADescriptorThatDoesNotBlockIsWrittenWhole) {
  Pipe pipe;
  ASSERT_EQ(::fcntl(pipe.ends[1], F_SETFL, O_NONBLOCK), 0);
  const std::string bytes(1 << 20, 'x');  // more than a pipe holds
  std::size_t count = 0;
  std::thread reader([&] {
    char part[4096];
    for (ssize_t n; count < bytes.size() && (n = ::read(pipe.ends[0], part, sizeof part)) > 0;)
      count += static_cast<std::size_t>(n);
  });
  write_output(pipe.name(1), bytes);
  reader.join();
  EXPECT_EQ(count, bytes.size());
}

// Invariant O3.
TEST(OutputFile, WithoutCommitARegularFileIsAsItWas) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "file", "old");
  {
    OutputFile file(folder / "file");
    file.write(std::string(1 << 20, 'x'));
    EXPECT_EQ(test::read_text(folder / "file"), "old");
  }
  EXPECT_EQ(test::read_text(folder / "file"), "old");
  EXPECT_EQ(files_in(folder.path()), std::set<std::string>{"file"});
}

TEST(OutputFolder, ResultsAreRegularFilesThatStayInIt) {
  const test::TemporaryFolder outside;
  const std::vector<std::string> names = {"stats.json", "frame_*.png", "points/*.json"};
  const auto says = [&](const std::function<void(const fs::path&)>& put) {
    const test::TemporaryFolder out;
    put(out.path());
    return refusal([&] { check_output_folder(out.path(), names); });
  };
  const auto link = [](const fs::path& to, const char* name) {
    return [=](const fs::path& out) {
      if (fs::path(name).has_parent_path()) fs::create_directory(out / fs::path(name).parent_path());
      fs::create_symlink(to, out / name);
    };
  };
  test::write_text(outside / "file", "x");
  fs::create_symlink("file", outside / "link");
  for (const char* name : {"stats.json", "frame_0001.png", "points/1.json"})
    for (const char* to : {"file", "link", "new"})
      EXPECT_THAT(says(link(outside / to, name)), HasSubstr("is a symlink that leaves")) << name << " " << to;
  EXPECT_THAT(says(link(outside.path(), "points")), HasSubstr("is a symlink that leaves"));
  EXPECT_THAT(says(link("../..", "stats.json")), HasSubstr("is a symlink that leaves"));
  EXPECT_THAT(says([](const fs::path& out) { fs::create_directory(out / "stats.json"); }), HasSubstr("is a folder"));
  EXPECT_THAT(says([](const fs::path& out) { ::mkfifo((out / "frame_7.png").c_str(), 0600); }), HasSubstr("is a FIFO"));
  EXPECT_THAT(says([](const fs::path& out) { test::write_text(out / "points", ""); }), HasSubstr("is not a folder"));
  EXPECT_THAT(refusal([&] { check_output_folder(outside / "file", names); }), HasSubstr("file is not a folder"));
  EXPECT_THAT(refusal([&] { check_output_folder(outside / "file" / "deep", names); }), HasSubstr("is not a folder"));

  EXPECT_EQ(says(link("other", "stats.json")), "");
  EXPECT_EQ(says(link("../stats.json", "points/1.json")), "");
  EXPECT_EQ(says(link(outside / "file", "notes")), "");  // no result
  EXPECT_EQ(says([](const fs::path& out) { fs::create_directory(out / "mine"); }), "");
  EXPECT_EQ(refusal([&] { check_output_folder(outside / "no" / "such", names); }), "");
  EXPECT_EQ(files_in(outside.path()), (std::set<std::string>{"file", "link"}));
}

}  // namespace
}  // namespace tessera::output_file_test
