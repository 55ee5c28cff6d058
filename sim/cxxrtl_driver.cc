// Runs a stream through a CXXRTL model, in compiled code. `sim/cxxrtl.py` puts the model's file name
// (BLYSK_MODEL), its key (BLYSK_KEY) and the optional members (BLYSK_HAS_...) in front of this text.
//
// One evaluation a clock is enough and exact. `eval()` computes every combinational output from the inputs and
// from the registers as they are, and puts what the registers become aside; `commit()` takes that over. Between the
// two, the outputs are therefore those just before the rising edge with this clock's inputs applied, including
// a `ready` that depends on the other side's `ready`; read there, nothing is stale. This needs a model
// whose `eval()` comes to rest in one pass: Yosys warns where it does not, and the builder refuses such a design.
//
// The model lives on the heap: g++ 12 -O2 miscompiles it as a local object.

#include <cxxrtl/cxxrtl.h>

// CXXRTL's own arithmetic goes through 32-bit chunks. In up to 64 bits the machine's is the same, modulo two to the
// width, and makes pipelines full of multipliers 1.6 times faster.
namespace cxxrtl_yosys {

template<size_t Bits>
CXXRTL_ALWAYS_INLINE uint64_t native_zext(const value<Bits> &from) {
	const uint64_t low = from.data[0];
	return Bits <= 32 ? low : low | uint64_t(from.data[from.chunks - 1]) << 32;
}

template<size_t Bits>
CXXRTL_ALWAYS_INLINE uint64_t native_sext(const value<Bits> &from) {
	return int64_t(native_zext(from) << (64 - Bits)) >> (64 - Bits);
}

template<size_t Bits>
CXXRTL_ALWAYS_INLINE value<Bits> native_value(uint64_t from) {
	value<Bits> result;
	result.data[0] = from;
	if (Bits > 32) result.data[result.chunks - 1] = from >> 32;
	result.data[result.chunks - 1] &= result.msb_mask;
	return result;
}

#define NATIVE(name, extend, operation) \
	template<size_t BitsY, size_t BitsA, size_t BitsB> \
	CXXRTL_ALWAYS_INLINE value<BitsY> native_##name(const value<BitsA> &a, const value<BitsB> &b) { \
		if constexpr (BitsY && BitsA && BitsB && BitsY <= 64 && BitsA <= 64 && BitsB <= 64) \
			return native_value<BitsY>(extend(a) operation extend(b)); \
		else \
			return name<BitsY>(a, b); \
	}
NATIVE(add_uu, native_zext, +)
NATIVE(add_ss, native_sext, +)
NATIVE(sub_uu, native_zext, -)
NATIVE(sub_ss, native_sext, -)
NATIVE(mul_uu, native_zext, *)
NATIVE(mul_ss, native_sext, *)
#undef NATIVE

} // namespace cxxrtl_yosys

#define add_uu native_add_uu
#define add_ss native_add_ss
#define sub_uu native_sub_uu
#define sub_ss native_sub_ss
#define mul_uu native_mul_uu
#define mul_ss native_mul_ss
#include BLYSK_MODEL

#ifdef BLYSK_FREESTANDING
// For a build without a C++ runtime library.
#include <cstdlib>
void *operator new(std::size_t size) {
	if (void *memory = std::malloc(size ? size : 1)) return memory;
	std::abort();
}
void *operator new[](std::size_t size) { return operator new(size); }
void operator delete(void *memory) noexcept { std::free(memory); }
void operator delete(void *memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void *memory) noexcept { std::free(memory); }
void operator delete[](void *memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace {

template<size_t Bits>
const uint32_t *words(const cxxrtl::value<Bits> &port) { return port.data; }

template<size_t Bits>
const uint32_t *words(const cxxrtl::wire<Bits> &port) { return port.curr.data; }

template<size_t Bits>
constexpr size_t count(const cxxrtl::value<Bits> &) { return cxxrtl::value<Bits>::chunks; }

template<size_t Bits>
constexpr size_t count(const cxxrtl::wire<Bits> &) { return cxxrtl::value<Bits>::chunks; }

template<size_t Bits>
void load(cxxrtl::value<Bits> &port, const uint32_t *from) { memcpy(port.data, from, sizeof port.data); }

template<size_t Bits>
void store(uint32_t *to, const cxxrtl::value<Bits> &port) { memcpy(to, port.data, sizeof port.data); }

template<size_t Bits>
void store(uint32_t *to, const cxxrtl::wire<Bits> &port) { memcpy(to, port.curr.data, sizeof port.curr.data); }

template<size_t Bits>
void fill(cxxrtl::value<Bits> &port) { port = cxxrtl::value<Bits>{}.bit_not(); }

// The numbers of `engine.End`.
enum End : int32_t { LIMIT, DONE, DROPPED, CHANGED, EXTRA, STUCK };

using Model = cxxrtl_design::p_top;

struct Simulation {
	Model model;
	uint32_t held[sizeof(Model::p_o____payload) / sizeof(uint32_t) + 1] = {};
	bool offered = false, waiting = false;
};

} // namespace

// The same members in `cxxrtl._Job`.
struct Job {
	const uint32_t *constants, *write, *input;
	const uint8_t *input_stalls, *output_stalls;
	int64_t write_count, input_count, input_period, output_period;
	int64_t count; // -1: as many as come
	int64_t patience, settle;
	// Where the run stands.
	int64_t clock, last, written, taken, given;
	// `output` and `clocks` hold one batch, `input_clocks` the whole run.
	uint32_t *output;
	int64_t *clocks, *input_clocks;
	uint32_t *status;
};

extern "C" {

const char *blysk_key() { return BLYSK_KEY; }

void *blysk_open() {
	Simulation *simulation = new Simulation;
	Model &model = simulation->model;
	model.p_clk.set(true);
	fill(model.p_i____payload);
#ifdef BLYSK_HAS_WRITE
	fill(model.p_write____payload);
#endif
	return simulation;
}

void blysk_close(void *handle) { delete static_cast<Simulation *>(handle); }

int32_t blysk_run(void *handle, Job *job, int64_t clocks) {
	Simulation &simulation = *static_cast<Simulation *>(handle);
	Model &model = simulation.model;
	bool offered = simulation.offered, waiting = simulation.waiting;
	int64_t clock = job->clock, last = job->last, written = job->written, taken = job->taken, given = job->given;
	const int64_t limit = clock + clocks, given_before = given;
	int64_t input_phase = clock % job->input_period, output_phase = clock % job->output_period;
	uint32_t *output = job->output;
	End end = LIMIT;
#ifdef BLYSK_HAS_CONSTANTS
	load(model.p_constants, job->constants);
#endif

	for (; clock != limit; clock++) {
		if (given == job->count && taken == job->input_count && written == job->write_count &&
				clock - last > job->settle) {
			end = DONE;
			break;
		}
		if (clock - last > job->patience) {
			end = job->count < 0 && taken == job->input_count ? DONE : STUCK;
			break;
		}

		const bool writing = written < job->write_count;
		if (writing) {
#ifdef BLYSK_HAS_WRITE
			model.p_write____valid.set(true);
			load(model.p_write____payload, job->write + written * count(model.p_write____payload));
#endif
		} else if (!offered && taken < job->input_count && !job->input_stalls[input_phase]) {
			offered = true;
			model.p_i____valid.set(true);
			load(model.p_i____payload, job->input + taken * count(model.p_i____payload));
		}
		const bool ready = !job->output_stalls[output_phase];
		model.p_o____ready.set(ready);
		if (++input_phase == job->input_period) input_phase = 0;
		if (++output_phase == job->output_period) output_phase = 0;

		model.prev_p_clk.set(false);
		model.eval();

		const bool valid = words(model.p_o____valid)[0];
		if (waiting) {
			if (!valid) {
				end = DROPPED;
				break;
			}
			if (memcmp(simulation.held, words(model.p_o____payload), sizeof(uint32_t) * count(model.p_o____payload))) {
				end = CHANGED;
				break;
			}
		}
		if (valid && given == job->count) {
			end = EXTRA;
			break;
		}
		waiting = valid && !ready;
		if (waiting) store(simulation.held, model.p_o____payload);
		bool moved = false;
		if (valid && ready) {
			store(output, model.p_o____payload);
			output += count(model.p_o____payload);
			job->clocks[given - given_before] = clock;
			given++;
			moved = true;
		}
		const bool input_moves = offered && words(model.p_i____ready)[0];
#ifdef BLYSK_HAS_WRITE
		const bool write_moves = writing && words(model.p_write____ready)[0];
#endif

		model.commit();

#ifdef BLYSK_HAS_WRITE
		if (write_moves) {
			moved = true;
			if (++written == job->write_count) {
				model.p_write____valid.set(false);
				fill(model.p_write____payload);
			}
		}
#endif
		if (input_moves) {
			job->input_clocks[taken] = clock;
			taken++;
			offered = false;
			moved = true;
			model.p_i____valid.set(false);
			// The next beat, if there is one to offer, goes over it.
			fill(model.p_i____payload);
		}
		if (moved) last = clock;
	}

#ifdef BLYSK_HAS_STATUS
	if (end == DONE || end == LIMIT) {
		// Without an edge: combinational outputs only.
		model.prev_p_clk.set(true);
		model.eval();
		store(job->status, model.p_status);
	}
#endif
	simulation.offered = offered;
	simulation.waiting = waiting;
	job->clock = clock;
	job->last = last;
	job->written = written;
	job->taken = taken;
	job->given = given;
	return end;
}

} // extern "C"
