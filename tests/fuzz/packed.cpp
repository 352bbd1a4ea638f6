// Logs and recordings from a disk, compressed or not, complete or torn: the text is the same for any size of the output
// buffer, each damage has its position in the file, and lines are those of the text.
//
// Input: a file.
#include <cerrno>
#include <string>

#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/common/line_reader.hpp"
#include "tools/common/packed_text.hpp"

using namespace bmu;

namespace {

/// A few bytes may expand to any amount, which is returned in pieces: reading this much is enough.
constexpr std::size_t text_max = std::size_t{1} << 20U;

struct Unpacked {
  std::string text;
  std::vector<PackedText::Damage> damages;
  bool is_whole = true;  // read to its end
};

Unpacked unpacked(std::string_view bytes, std::size_t room) {
  const fuzz::MemoryFile file(bytes);
  PackedText packed(file.fd());
  std::vector<char> buffer(room);
  Unpacked all;
  while (all.text.size() < text_max) {
    const PackedText::Read read = packed.read(buffer);
    if (read.status == PackedText::Status::end) return all;
    if (read.status == PackedText::Status::damaged) {
      all.damages.push_back(packed.damage());
      continue;
    }
    FUZZ_CHECK(read.status == PackedText::Status::text && read.size > 0 && read.size <= buffer.size());
    all.text.append(buffer.data(), read.size);
  }
  all.is_whole = false;
  return all;
}

void check_damages(const Unpacked& all, std::size_t file_size) {
  std::uint64_t behind = 0;
  for (const PackedText::Damage& damage : all.damages) {
    FUZZ_CHECK(!damage.what.empty());
    FUZZ_CHECK(damage.begin >= behind && damage.begin <= damage.end && damage.end <= file_size);
    behind = damage.begin;
  }
  FUZZ_CHECK(all.damages.size() <= file_size);
}

void check_lines(std::string_view bytes, const Unpacked& all) {
  const fuzz::MemoryFile file(bytes);
  LineReader reader(file.fd());
  LineReader::Line line;
  std::uint64_t count = 0;
  std::string text;
  while (text.size() < text_max) {
    while (reader.take(line)) {
      FUZZ_CHECK(reader.line_number() > count && line.text.find('\n') == std::string_view::npos);
      count = reader.line_number();
      text.append(line.text).append(line.has_end ? "\n" : "");
    }
    const LineReader::Filled filled = reader.fill();
    FUZZ_CHECK(filled != LineReader::Filled::error && filled != LineReader::Filled::interrupted);
    if (filled == LineReader::Filled::end) break;
  }
  while (reader.take(line)) text.append(line.text).append(line.has_end ? "\n" : "");
  const bool has_long_lines = all.text.size() >= LineReader::buffer_size;
  if (all.is_whole && all.damages.empty() && !has_long_lines) FUZZ_CHECK(text == all.text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::text_of(data, size);
  const Unpacked all = unpacked(bytes, 65'536);
  check_damages(all, size);
  const Unpacked slowly = unpacked(bytes, 7);
  const std::size_t both = std::min(all.text.size(), slowly.text.size());
  FUZZ_CHECK(all.text.compare(0, both, slowly.text, 0, both) == 0);
  if (all.is_whole && slowly.is_whole) {
    FUZZ_CHECK(all.text.size() == slowly.text.size() && all.damages.size() == slowly.damages.size());
  }
  check_lines(bytes, all);
  return 0;
}
