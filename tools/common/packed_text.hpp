// Bytes of a file or pipe, unpacked where they are packed with zstd or gzip: recordings and logs, as they lie on a disk
// or come through a pipe. Who reads does not see a difference.
//
//   PackedText text(fd);                       plain or packed, told by its bytes, not by a name
//   while (true) {
//     const PackedText::Read read = text.read(buffer);
//     ...                                      text, end, interrupted, damaged or failed: see Status
//   }
//
// Frames of zstd (members of gzip) one after another are one text: a writer may end a frame whenever it wants to be
// sure of what it has written, and begin the next; skippable frames are skipped. A frame that was torn (power lost,
// disk full, bytes changed) is read as far as it is good, then told as `damaged` with its place, and reading goes on
// with the next frame that begins behind it, if there is one: a recording that was gone on with after a power loss has
// only the hole. What is packed with xz, bzip2 or lz4 is damaged as a whole, and told by that name.
//
// Where a file does not begin with a frame, but one follows within its first MiB, what comes before is damage: the
// first magic was changed, or something stands ahead of it. Text in which no frame is found is text, whatever bytes it
// has.
//
// What is damaged is found by the form of the data and, where the writer put one in (gzip does, zstd does with
// `ZSTD_c_checksumFlag`), by a checksum at the end of each frame. By then its text has been given out; `damaged` tells
// that it may be wrong.
//
// Memory is constant: about 0.6 MB (1 MB more where a file begins with neither text nor a frame), and for packed text
// the window of its writer, 8 MB with the highest usual level of zstd (19), 32 kB with gzip. Frames that want more than
// window_max (zstd --ultra and --long) are refused as damage, not obeyed: a file of a stranger must not decide how much
// memory is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace bmu {

class PackedText {
 public:
  static constexpr std::size_t window_max = std::size_t{16} << 20U;

  enum class Status : std::uint8_t {
    text,         // `size` bytes, at least one
    end,          // no more
    interrupted,  // a signal came; nothing is lost, read again
    damaged,      // see damage(); what comes next, if anything, does not join what came before
    failed,       // the system would not read; errno tells
  };
  struct Read {
    Status status = Status::end;
    std::size_t size = 0;
  };
  struct Damage {
    std::uint64_t begin = 0;  // offsets in the packed file: of the frame that is damaged, or of what is no frame
    std::uint64_t end = 0;    // where reading goes on, or the file ends
    std::string what;
  };

  /// The descriptor stays the caller's.
  explicit PackedText(int fd);
  PackedText(const PackedText&) = delete;
  PackedText& operator=(const PackedText&) = delete;
  ~PackedText();

  /// Waits as read(2) does, once at most for a plain file; packed ones until there is text. `into` must not be empty.
  [[nodiscard]] Read read(std::span<char> into);
  /// Of the last read that was `damaged`.
  [[nodiscard]] const Damage& damage() const;
  /// Known after the first read, but for a file that begins with damage: then once that was told.
  [[nodiscard]] bool is_packed() const;

 private:
  class Unpacker;

  std::unique_ptr<Unpacker> unpacker_;
};

}  // namespace bmu
