// Bytes of a file or pipe, decompressed if they are compressed with zstd or gzip: recordings and logs, from a disk or a
// pipe. The reader does not see a difference.
//
//   PackedText text(fd);                       plain or compressed, detected by its bytes, not by a name
//   while (true) {
//     const PackedText::Read read = text.read(buffer);
//     ...                                      text, end, interrupted, damaged or failed: see Status
//   }
//
// Frames of zstd (members of gzip) one after another are one text: a writer may end a frame whenever it must secure the
// written data, and start the next; skippable frames are skipped. A torn frame (power lost, disk full, bytes changed)
// is read as far as it is valid, then reported as `damaged` with its position, and reading continues with the next
// frame after it, if there is one: a recording that was continued after a power loss has only the gap. Input compressed
// with xz, bzip2 or lz4 is damaged as a whole, and reported by that name.
//
// If a file does not start with a frame, but one follows within its first MiB, the bytes before it are damage: the
// first magic was changed, or other bytes precede it. Text without any frame is plain text, with any bytes.
//
// Damage is detected by the form of the data and, if the writer added one (gzip does, zstd does with
// `ZSTD_c_checksumFlag`), by a checksum at the end of each frame. By then the text of the frame has been returned;
// `damaged` means that it may be wrong.
//
// Memory is constant: about 0.6 MB (1 MB more if a file starts with neither text nor a frame), and for compressed text
// the window of its writer, 8 MB with the highest usual level of zstd (19), 32 kB with gzip. Frames that require more
// than window_max (zstd --ultra and --long) are refused as damage: an untrusted file must not determine how much memory
// is used.
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
    interrupted,  // by a signal; nothing is lost, read again
    damaged,      // see damage(); the following text, if any, does not continue the text before
    failed,       // the read failed; see errno
  };
  struct Read {
    Status status = Status::end;
    std::size_t size = 0;
  };
  struct Damage {
    std::uint64_t begin = 0;  // offsets in the compressed file: of the damaged frame, or of bytes outside a frame
    std::uint64_t end = 0;    // where reading resumes, or the end of the file
    std::string what;
  };

  /// The caller keeps ownership of the descriptor.
  explicit PackedText(int fd);
  PackedText(const PackedText&) = delete;
  PackedText& operator=(const PackedText&) = delete;
  ~PackedText();

  /// Waits as read(2) does, at most once for a plain file; for a compressed one until there is text. `into` must not be
  /// empty.
  [[nodiscard]] Read read(std::span<char> into);
  /// Of the last read that returned `damaged`.
  [[nodiscard]] const Damage& damage() const;
  /// Valid after the first read; for a file that starts with damage, after that was reported.
  [[nodiscard]] bool is_packed() const;

 private:
  class Unpacker;

  std::unique_ptr<Unpacker> unpacker_;
};

}  // namespace bmu
