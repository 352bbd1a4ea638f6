#include "tools/bmudump/identify/device_hint.hpp"

#include <algorithm>
#include <iterator>

#include "devices/device_list.hpp"
#include "tools/bmudump/identify/device_fit.hpp"

namespace bmu::dump {
namespace {

/// True if a rejection does not contradict the row of the frame.
bool is_judged_by_its_row(const CheckedFrame& verdict) {
  if (verdict.is_accepted) return true;
  switch (verdict.reason) {
    case RejectReason::unknown_id:
    case RejectReason::wrong_length:
    case RejectReason::wrong_crc: return false;
    default: return verdict.message != nullptr;
  }
}

/// Identifiers of devices have other meanings in cars: length, checksum and ranges must fit too.
Fit fit_of_device(const Device& device, const CanFrame& frame) {
  const MessageSpec* const message = device.catalogue->find(frame).message;
  return message == nullptr ? Fit::no : fit_of(*message, frame);
}

bool has(const Device& device, const CanFrame& frame) {
  return fit_of_device(device, frame) != Fit::no;
}

}  // namespace

void DeviceHint::note_rejected(const CanFrame& frame, const CheckedFrame& verdict) {
  if (seen_.size() == seen_max || is_judged_by_its_row(verdict) || frame.is_remote || frame.is_error) return;
  if (frame.is_extended) {
    const auto is_same = [&frame](const CanFrame& one) { return one.is_extended && one.id == frame.id; };
    if (std::any_of(seen_.begin(), seen_.end(), is_same)) return;
  } else {
    if (frame.id >= Catalogue::id_count || has_short_[frame.id]) return;
    has_short_[frame.id] = true;
  }
  seen_.push_back(frame);
}

std::vector<CanFrame> DeviceHint::left() const {
  std::vector<CanFrame> left;
  std::copy_if(seen_.begin(), seen_.end(), std::back_inserter(left),
               [this](const CanFrame& one) { return one.is_extended || !is_explained_[one.id]; });
  return left;
}

std::size_t DeviceHint::explained_by(const Device& device) const {
  const std::vector<CanFrame> all = left();
  return static_cast<std::size_t>(
      std::count_if(all.begin(), all.end(), [&device](const CanFrame& one) { return has(device, one); }));
}

std::vector<const Device*> DeviceHint::candidates(std::span<const Device* const> read) const {
  constexpr std::size_t short_ids_min = 3;
  const std::vector<CanFrame> all = left();
  std::vector<const Device*> best;
  std::size_t most = 0;
  for (const Device* device : all_devices()) {
    const bool is_read = std::find(read.begin(), read.end(), device) != read.end();
    const std::size_t count = explained_by(*device);
    const bool has_long = std::any_of(all.begin(), all.end(),
                                      [device](const CanFrame& one) { return one.is_extended && has(*device, one); });
    const bool has_proof = std::any_of(
        all.begin(), all.end(), [device](const CanFrame& one) { return fit_of_device(*device, one) == Fit::proven; });
    const bool is_likely = (count >= short_ids_min || has_long) && has_proof && 2 * count > all.size();
    if (is_read || !is_likely || count < most) continue;
    if (count > most) best.clear();
    most = count;
    best.push_back(device);
  }
  return best;
}

}  // namespace bmu::dump
