// The end of a thread that writes to a disk: a disk that does not answer must not keep a daemon from ending.
#pragma once

#include <thread>

namespace bmu {

/// `has_ended`: it is done, or about to return. If not, it hangs in a disk: it is left behind, and what it needs has to
/// be its own or shared with it.
inline void join_or_leave(std::thread& thread, bool has_ended) {
  if (has_ended) {
    thread.join();
  } else {
    thread.detach();
  }
}

}  // namespace bmu
