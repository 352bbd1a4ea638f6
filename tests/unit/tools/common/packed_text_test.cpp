// Compressed logs: consecutive frames are one text; data that is truncated, cut or not compressed in this way is
// reported with its position, and the remainder is read.
#include "tools/common/packed_text.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/common/line_reader.hpp"

namespace {

using namespace bmu;

struct Packing {
  int level = 3;
  int window_log = 0;
  bool has_checksum = true;
};

std::string packed(std::string_view text, const Packing& how = {}) {
  ZSTD_CCtx* const context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, how.level);
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, how.has_checksum ? 1 : 0);
  if (how.window_log > 0) ZSTD_CCtx_setParameter(context, ZSTD_c_windowLog, how.window_log);
  if (how.window_log > 0) ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  std::string out(ZSTD_compressBound(text.size()), '\0');
  // As a writer that does not know the end: the window is then not reduced to the size of the text.
  ZSTD_inBuffer from{text.data(), text.size(), 0};
  ZSTD_outBuffer to{out.data(), out.size(), 0};
  ZSTD_compressStream2(context, &to, &from, ZSTD_e_continue);
  REQUIRE(ZSTD_compressStream2(context, &to, &from, ZSTD_e_end) == 0);
  ZSTD_freeCCtx(context);
  out.resize(to.pos);
  return out;
}

/// Text as compressed by gzip.
std::string gzipped(std::string_view text, int level = 6) {
  z_stream stream{};
  constexpr int gzip_window = 15 + 16;
  REQUIRE(deflateInit2(&stream, level, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string in(text);
  std::string out(deflateBound(&stream, static_cast<uLong>(text.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// Lines that compress badly: compressed, they are several blocks.
std::string lines(int count, unsigned seed = 1) {
  std::string text;
  std::uint32_t random = seed;
  for (int line = 0; line < count; ++line) {
    text += "line " + std::to_string(line) + ' ';
    for (int digit = 0; digit < 40; ++digit) {
      random = random * 1'664'525U + 1'013'904'223U;
      text += static_cast<char>('A' + (random >> 24U) % 26);
    }
    text += '\n';
  }
  return text;
}

struct Unpacked {
  std::string text;
  std::vector<PackedText::Damage> damage;
  bool is_packed = false;
};

Unpacked unpacked_from(int fd, std::size_t room) {
  Unpacked all;
  PackedText text(fd);
  std::vector<char> buffer(room);
  while (true) {
    const PackedText::Read read = text.read(buffer);
    all.is_packed = text.is_packed();
    if (read.status == PackedText::Status::damaged) {
      all.damage.push_back(text.damage());
    } else if (read.status == PackedText::Status::text) {
      REQUIRE(read.size > 0);
      all.text.append(buffer.data(), read.size);
    } else {
      REQUIRE(read.status == PackedText::Status::end);
      return all;
    }
  }
}

Unpacked unpacked(const std::string& file, std::size_t room = 10'000) {
  const TemporaryFolder folder;
  const OwnedFd fd(::open(folder.file("packed", file).c_str(), O_RDONLY | O_CLOEXEC));
  REQUIRE(fd.is_open());
  return unpacked_from(fd.get(), room);
}

template <class Pack>
void look_at_changed_bytes(Pack pack) {
  const std::string text = lines(40);
  const std::string good = pack(text);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    const Unpacked all = unpacked(bad + pack("next\n"));
    INFO("byte " << at);
    CHECK((!all.damage.empty() || all.text == text + "next\n"));
    CHECK(all.text.ends_with("next\n"));
  }
}

}  // namespace

TEST_CASE("plain text is given out as it is, whatever its length", "[unit][packed_text]") {
  for (const std::string& text : {std::string(), std::string("("), std::string("(1."), lines(1), lines(20'000)}) {
    const Unpacked all = unpacked(text);
    CHECK(all.text == text);
    CHECK(all.damage.empty());
    CHECK_FALSE(all.is_packed);
  }
}

TEST_CASE("packed text is unpacked whatever the room to write to and whatever the level", "[unit][packed_text]") {
  const std::string text = lines(20'000);
  for (const int level : {1, 3, 19}) {
    for (const std::size_t room : {std::size_t{1'000}, std::size_t{262'144}}) {
      const Unpacked all = unpacked(packed(text, {.level = level}), room);
      CHECK((all.text == text));
      CHECK(all.damage.empty());
      CHECK(all.is_packed);
    }
  }
  CHECK(unpacked(packed("one byte at a time"), 1).text == "one byte at a time");
}

TEST_CASE("frames one after another are one text, empty and skippable ones between them are nothing",
          "[unit][packed_text]") {
  const std::string skippable("\x53\x2A\x4D\x18\x04\x00\x00\x00note", 12);
  const Unpacked all = unpacked(skippable + packed("one ") + packed("") + skippable + packed("text\n"));
  CHECK(all.text == "one text\n");
  CHECK(all.damage.empty());
}

TEST_CASE("a pipe that gives single bytes is unpacked as a file", "[unit][packed_text]") {
  const std::string file = packed(lines(30)) + packed("end\n");
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  const OwnedFd from(ends[0]);
  std::thread writer([&file, to = ends[1]] {
    for (const char one : file) {
      if (::write(to, &one, 1) != 1) break;
    }
    ::close(to);
  });
  const Unpacked all = unpacked_from(from.get(), 100);
  writer.join();
  CHECK(all.text == lines(30) + "end\n");
  CHECK(all.damage.empty());
}

TEST_CASE("a frame that is cut off gives all its whole blocks and is named", "[unit][packed_text]") {
  const std::string text = lines(20'000);
  const std::string whole = packed(text);
  for (const std::size_t length : {std::size_t{3} + 4, whole.size() / 2, whole.size() - 1}) {
    const Unpacked all = unpacked(whole.substr(0, length));
    CHECK(text.starts_with(all.text));
    // A block is 128 kB of text at most.
    const double part = static_cast<double>(length) / static_cast<double>(whole.size());
    CHECK(static_cast<double>(all.text.size()) >= part * static_cast<double>(text.size()) - 140'000);
    REQUIRE(all.damage.size() == 1);
    CHECK(all.damage[0].begin == 0);
    CHECK(all.damage[0].end == length);
    CHECK(all.damage[0].what == "this zstd frame has no end");
  }
}

TEST_CASE("garbage behind a good frame is named by its offset", "[unit][packed_text]") {
  const std::string good = packed("good\n");
  for (const std::string& garbage : {std::string("\n"), std::string("not packed at all"), std::string(500'000, 'x')}) {
    const Unpacked all = unpacked(good + garbage);
    CHECK(all.text == "good\n");
    REQUIRE(all.damage.size() == 1);
    CHECK(all.damage[0].begin == good.size());
    CHECK(all.damage[0].end == good.size() + garbage.size());
  }
  CHECK(unpacked(good + "not packed at all").damage[0].what == "no zstd frame begins here");
}

TEST_CASE("behind a torn frame or garbage the next frame is found", "[unit][packed_text]") {
  const std::string first = packed(lines(20'000));
  const std::string second = packed(lines(50, 2));
  const Unpacked torn = unpacked(first.substr(0, first.size() / 2) + second + packed("third\n"));
  CHECK(torn.text.ends_with(lines(50, 2) + "third\n"));
  CHECK(torn.text.starts_with(lines(1)));
  REQUIRE(torn.damage.size() == 1);
  CHECK(torn.damage[0].begin == 0);
  CHECK(torn.damage[0].end == first.size() / 2);
  const Unpacked between = unpacked(packed("one\n") + std::string(300'000, '?') + second);
  CHECK(between.text == "one\n" + lines(50, 2));
  CHECK(between.damage.size() == 1);
}

TEST_CASE("a file whose begin is neither text nor a frame is read from its first whole frame on",
          "[unit][packed_text]") {
  const std::string first = packed(lines(12'000));  // longer than the part that is kept
  REQUIRE(first.size() > 300'000);
  const std::string rest = packed("second\n") + packed("third\n");
  const auto look = [](const std::string& file, std::size_t damaged, const std::string& text) {
    const Unpacked all = unpacked(file);
    CHECK((all.text == text));
    CHECK(all.is_packed);
    REQUIRE(all.damage.size() == 1);
    CHECK(all.damage[0].begin == 0);
    CHECK(all.damage[0].end == damaged);
    CHECK(all.damage[0].what == "no zstd frame begins here, but one behind it");
  };
  std::string changed = first;
  changed[0] = static_cast<char>(changed[0] ^ 1);
  look(changed + rest, first.size(), "second\nthird\n");
  std::fill_n(changed.begin(), 512, '\0');
  look(changed + rest, first.size(), "second\nthird\n");
  for (const std::string& ahead : {std::string("a line of junk\n"), std::string("\xFF"), std::string("(")}) {
    look(ahead + rest, ahead.size(), "second\nthird\n");
    look(ahead + first, ahead.size(), lines(12'000));
  }
  // Data that only looks like a frame is skipped.
  const std::string false_frame = "\xFF\x28\xB5\x2F\xFD\xFF\xFF\xFF\xFF";
  look(false_frame + rest, false_frame.size(), "second\nthird\n");
  const Unpacked stream = unpacked("\xFF" + gzipped("text\n"));
  CHECK(stream.text == "text\n");
  REQUIRE(stream.damage.size() == 1);
  CHECK(stream.damage[0].what == "no gzip stream begins here, but one behind it");
}

TEST_CASE("a frame is looked for in the first MiB", "[unit][packed_text]") {
  const std::string frame = packed("text\n");
  CHECK(unpacked(std::string(1'000'000, '\0') + frame).text == "text\n");
  const std::string far = std::string(1'400'000, '\0') + frame;
  CHECK((unpacked(far).text == far));
}

TEST_CASE("text with odd bytes and no frame behind them is text", "[unit][packed_text]") {
  const std::string text = lines(40'000);
  for (const std::string& ahead : {std::string("\xFF"), std::string(512, '\0'), std::string(700'000, '\0'),
                                   std::string("(\xB5/"), std::string("\x28\xB5\x2F\xFD no frame\n").insert(0, "x")}) {
    const Unpacked all = unpacked(ahead + text);
    CHECK((all.text == ahead + text));
    CHECK(all.damage.empty());
    CHECK_FALSE(all.is_packed);
  }
  const std::string binary(3'000'000, '\x80');
  CHECK((unpacked(binary).text == binary));
}

TEST_CASE("a pipe gives its text as it comes, and may begin with damage", "[unit][packed_text]") {
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  const OwnedFd from(ends[0]);
  OwnedFd to(ends[1]);
  const auto write = [&to](const std::string& bytes) {
    REQUIRE(::write(to.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  };
  PackedText text(from.get());
  std::array<char, 1'000> buffer{};
  write("an odd \xFF byte\n(");
  PackedText::Read read = text.read(buffer);
  CHECK(std::string_view(buffer.data(), read.size) == "an odd \xFF byte\n");
  write("and a line\n");
  read = text.read(buffer);
  CHECK(std::string_view(buffer.data(), read.size) == "(and a line\n");
  const std::string frame = packed("a frame\n");
  write(frame.substr(0, 6));
  std::thread writer([&] {
    write(frame.substr(6));
    to = OwnedFd();
  });
  read = text.read(buffer);
  writer.join();
  REQUIRE(read.status == PackedText::Status::damaged);
  CHECK(text.damage().end == 26);
  std::string of_frame;  // in any number of pieces
  for (read = text.read(buffer); read.status == PackedText::Status::text; read = text.read(buffer)) {
    of_frame.append(buffer.data(), read.size);
  }
  CHECK(of_frame == "a frame\n");
  CHECK(read.status == PackedText::Status::end);
}

TEST_CASE("any changed byte of a packed text ends in the same text or is named", "[unit][packed_text]") {
  look_at_changed_bytes([](const std::string& text) { return packed(text); });
}

TEST_CASE("a checksum that is wrong is named as such", "[unit][packed_text]") {
  std::string bad = packed("hello\n");
  bad.back() = static_cast<char>(bad.back() ^ 1);
  const Unpacked all = unpacked(bad);
  CHECK(all.text == "hello\n");
  REQUIRE(all.damage.size() == 1);
  CHECK(all.damage[0].what.find("checksum") != std::string::npos);
}

TEST_CASE("all that comes before damage is given out, whatever the room to write to", "[unit][packed_text]") {
  const std::string text = lines(40);
  std::string bad = packed(text);
  bad.back() = static_cast<char>(bad.back() ^ 0x01);
  for (const std::size_t room : {std::size_t{1}, std::size_t{7}, text.size() - 1, text.size(), std::size_t{65'536}}) {
    const Unpacked all = unpacked(bad, room);
    INFO("room for " << room);
    CHECK((all.text == text));
    CHECK(all.damage.size() == 1);
  }
}

TEST_CASE("a block is given out though the header behind it is damaged", "[unit][packed_text]") {
  using namespace std::string_literals;
  const std::string head = "\x28\xB5\x2F\xFD\x00\x58"s;  // a window, no checksum
  const std::string fives = "\x2A\x00\x00x"s;            // a block: one letter, five times
  const std::string plain = "\x28\x00\x00"s + "plain";   // a block that is not compressed
  const std::string reserved = "\x2E\x00\x00y"s;         // of an undefined kind
  for (const std::size_t room : {std::size_t{1}, std::size_t{5}, std::size_t{65'536}}) {
    const Unpacked all = unpacked(head + fives + plain + fives + reserved, room);
    INFO("room for " << room);
    CHECK(all.text == "xxxxxplainxxxxx");
    CHECK(all.damage.size() == 1);
  }
}

TEST_CASE("what comes before a frame is text or damage as a whole, whatever the room to write to",
          "[unit][packed_text]") {
  // Text up to a possible start of a frame, which is cut; its last part alone would not be accepted as text.
  const std::string text = "a log that begins well, then does not" + std::string(12, '\xFF');
  const std::string file = text + packed(lines(40)).substr(0, 100) + packed("next\n");
  const Unpacked whole = unpacked(file, 65'536);
  CHECK(whole.text == text + "next\n");
  CHECK(whole.damage.size() == 1);
  for (const std::size_t room : {std::size_t{1}, std::size_t{7}, text.size() - 1}) {
    const Unpacked all = unpacked(file, room);
    INFO("room for " << room);
    CHECK(all.text == whole.text);
    CHECK(all.damage.size() == whole.damage.size());
  }
}

TEST_CASE("formats from before zstd 0.8 are no frames behind a good one", "[unit][packed_text]") {
  const std::string good = packed("good\n");
  for (const char magic : {'\x25', '\x26', '\x27'}) {
    const std::string old = magic + std::string("\xB5\x2F\xFD") + "damaged, whatever the format";
    for (const std::size_t room : {std::size_t{1}, std::size_t{7}, std::size_t{65'536}}) {
      const Unpacked all = unpacked(good + old + good, room);
      INFO("room for " << room);
      CHECK((all.text == "good\ngood\n"));
      REQUIRE(all.damage.size() == 1);
      CHECK(all.damage[0].begin == good.size());
      CHECK(all.damage[0].end == good.size() + old.size());
      CHECK(all.damage[0].what == "no zstd frame begins here");
    }
  }
}

TEST_CASE("a header that holds the bytes of another frame is read as a header", "[unit][packed_text]") {
  using namespace std::string_literals;
  // A dictionary and the size of the text, together an empty frame, or one to be skipped.
  const std::string frame = "\x28\xB5\x2F\xFD\xC3"s + "\x28\xB5\x2F\xFD\x00\x58\x01\x00\x00\x00\x00\x00\x00"s;
  const std::string skippable = "\x28\xB5\x2F\xFD\xE3"s + "\x50\x2A\x4D\x18\x00\x00\x00\x00\x00\x00\x00\x00"s;
  for (const std::string& header : {frame, skippable}) {
    for (const std::size_t room : {std::size_t{7}, std::size_t{65'536}}) {
      const Unpacked all = unpacked(header + packed("next\n"), room);
      INFO("room for " << room);
      CHECK(all.text == "next\n");
      REQUIRE_FALSE(all.damage.empty());
      CHECK(all.damage[0].begin == 0);
      CHECK(all.damage[0].what == "this zstd frame was packed with a dictionary");
    }
  }
}

TEST_CASE("a frame that wants too much memory is refused with the way out, the next is read", "[unit][packed_text]") {
  const Unpacked all = unpacked(packed(lines(10), {.window_log = 27}) + packed("next\n"));
  CHECK(all.text == "next\n");
  REQUIRE(all.damage.size() == 1);
  CHECK(all.damage[0].what.find("zstd -d") != std::string::npos);
  CHECK(unpacked(packed(lines(10), {.window_log = 24})).text == lines(10));
}

TEST_CASE("gzip is unpacked whatever the room to write to and whatever the level", "[unit][packed_text]") {
  const std::string text = lines(20'000);
  for (const int level : {0, 1, 6, 9}) {
    for (const std::size_t room : {std::size_t{1'000}, std::size_t{262'144}}) {
      const Unpacked all = unpacked(gzipped(text, level), room);
      CHECK((all.text == text));
      CHECK(all.damage.empty());
      CHECK(all.is_packed);
    }
  }
  CHECK(unpacked(gzipped("one byte at a time"), 1).text == "one byte at a time");
  CHECK(unpacked(gzipped(std::string(3'000'000, 'a')), 70'000).text == std::string(3'000'000, 'a'));
}

TEST_CASE("streams of gzip one after another are one text", "[unit][packed_text]") {
  const Unpacked all = unpacked(gzipped("one ") + gzipped("") + gzipped("text\n"));
  CHECK(all.text == "one text\n");
  CHECK(all.damage.empty());
}

TEST_CASE("gzip that is cut off is read to there and named", "[unit][packed_text]") {
  const std::string text = lines(20'000);
  const std::string whole = gzipped(text);
  for (const std::size_t length : {std::size_t{10}, whole.size() / 2, whole.size() - 9, whole.size() - 1}) {
    const Unpacked all = unpacked(whole.substr(0, length));
    CHECK(text.starts_with(all.text));
    const double part = static_cast<double>(length) / static_cast<double>(whole.size());
    CHECK(static_cast<double>(all.text.size()) >= part * static_cast<double>(text.size()) - 140'000);
    REQUIRE(all.damage.size() == 1);
    CHECK(all.damage[0].begin == 0);
    CHECK(all.damage[0].end == length);
    CHECK(all.damage[0].what == "this gzip stream has no end");
  }
}

TEST_CASE("any changed byte of a gzip stream ends in the same text or is named, and the next stream is read",
          "[unit][packed_text]") {
  look_at_changed_bytes([](const std::string& text) { return gzipped(text); });
}

TEST_CASE("what is wrong with gzip is named", "[unit][packed_text]") {
  std::string wrong_sum = gzipped("hello\n");
  wrong_sum[wrong_sum.size() - 5] = static_cast<char>(wrong_sum[wrong_sum.size() - 5] ^ 1);
  const Unpacked all = unpacked(wrong_sum);
  CHECK(all.text == "hello\n");
  REQUIRE(all.damage.size() == 1);
  CHECK(all.damage[0].what.find("checksum") != std::string::npos);
  const std::string good = gzipped("good\n");
  const Unpacked behind = unpacked(good + "not packed");
  CHECK(behind.text == "good\n");
  REQUIRE(behind.damage.size() == 1);
  CHECK(behind.damage[0].begin == good.size());
  CHECK(behind.damage[0].end == good.size() + 10);
  CHECK(behind.damage[0].what == "no gzip stream begins here");
}

TEST_CASE("packings that are not read are named with the way out", "[unit][packed_text]") {
  struct Case {
    std::string magic, what;
  };
  for (const Case& one :
       {Case{{"\xFD\x37zXZ\0", 6}, "this is packed with xz, which is not read here; unpack it with xz -d"},
        Case{"BZh9", "this is packed with bzip2, which is not read here; unpack it with bzip2 -d"},
        Case{"\x04\x22\x4D\x18", "this is packed with lz4, which is not read here; unpack it with lz4 -d"}}) {
    for (const std::size_t rest : {std::size_t{0}, std::size_t{300'000}}) {
      const Unpacked all = unpacked(one.magic + std::string(rest, 'x'));
      CHECK(all.text.empty());
      REQUIRE(all.damage.size() == 1);
      CHECK(all.damage[0].begin == 0);
      CHECK(all.damage[0].end == one.magic.size() + rest);
      CHECK(all.damage[0].what == one.what);
    }
  }
  // Text with a similar start is text.
  for (const char* const text : {"BZ", "BZh", "BZhx\n", "\x1F\x8B", "\x1F\x8B\x08\xFFxxxxxx"}) {
    CHECK(unpacked(text).text == text);
    CHECK(unpacked(text).damage.empty());
  }
}

TEST_CASE("a line torn by damage is left out and counted, the next is whole", "[unit][packed_text]") {
  const TemporaryFolder folder;
  const std::string whole = packed("first\nsecond, which is cut", {.has_checksum = false});
  // Without its last block header the frame has no end, but its text has been returned.
  const std::string file = folder.file("packed", packed("zero\n") + whole + "garbage" + packed("third\n"));
  const OwnedFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  LineReader reader(fd.get());
  std::vector<std::string> taken;
  std::vector<std::uint64_t> numbers;
  int damaged = 0;
  for (auto filled = LineReader::Filled::more; filled != LineReader::Filled::end; filled = reader.fill()) {
    if (filled == LineReader::Filled::damaged) ++damaged;
    for (LineReader::Line line; reader.take(line);) {
      taken.emplace_back(line.text);
      numbers.push_back(reader.line_number());
    }
  }
  CHECK(taken == std::vector<std::string>{"zero", "first", "third"});
  CHECK(numbers == std::vector<std::uint64_t>{1, 2, 4});
  CHECK(damaged == 1);
}
