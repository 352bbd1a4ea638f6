// Replies as bmuctl shows them: a daemon of another version, or another program on that socket, may send anything.
//
// Input: width and height of the window (1 each), then a reply.
#include <cstdlib>
#include <optional>
#include <string>

#include "tests/fuzz/fuzz.hpp"
#include "tools/bmuctl/cell_choice.hpp"
#include "tools/bmuctl/picture.hpp"
#include "tools/bmuctl/text_pages.hpp"

using namespace bmu;

namespace {

constexpr Page (*pages[])(const Reply&) = {status_page,  cells_page,  faults_page,     why_page,  clear_page,
                                           modules_page, accept_page, assignment_page, wake_page, balance_page,
                                           health_page,  buses_page,  drive_page};

void check_pages(const Reply& reply) {
  for (const auto page : pages) {
    const std::string text = page(reply).text(false);
    FUZZ_CHECK(text.find('\x1B') == std::string::npos);
  }
  static_cast<void>(leaves_faults(reply));
  static_cast<void>(leaves_unaccepted(reply));
}

void check_picture(const Reply& reply, int width, int height) {
  BusTrend trend;
  trend.take(reply["status"]);
  for (const PictureTopic topic :
       {PictureTopic::overview, PictureTopic::faults, PictureTopic::limits, PictureTopic::buses, PictureTopic::help}) {
    for (const CellsForm form : {CellsForm::fitting, CellsForm::bars, CellsForm::numbers}) {
      for (const bool bars_span_cells : {false, true}) {
        Canvas canvas(width, height, plain_glyphs.cut);
        const PictureView view{.topic = topic, .form = form, .bars_span_cells = bars_span_cells, .first = height / 2};
        const PictureExtent extent = draw_picture(reply, view, trend, "", plain_glyphs, canvas);
        FUZZ_CHECK(extent.shown >= 0 && extent.shown <= std::max(extent.total, 0));
        const auto rows = fuzz::lines_of(canvas.text(false));
        FUZZ_CHECK(rows.size() <= static_cast<std::size_t>(height));
      }
      if (topic != PictureTopic::overview) break;
    }
  }
  FUZZ_CHECK(compact_line(reply).find('\n') == std::string::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool is_utc = ::setenv("TZ", "UTC0", 1) == 0;  // NOLINT(concurrency-mt-unsafe): one thread
  FUZZ_CHECK(is_utc);
  if (size < 2) return 0;
  const auto json = nlohmann::json::parse(fuzz::text_of(data + 2, size - 2), nullptr, false);
  if (json.is_discarded()) return 0;
  const Reply reply(json);
  check_pages(reply);
  check_picture(reply, 1 + data[0] % 160, 1 + data[1] % 60);
  return 0;
}
