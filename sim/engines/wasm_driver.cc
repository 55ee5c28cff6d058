// This text follows `cxxrtl_driver.cc`. Both texts together make a WebAssembly module without imports. Memory is given
// out from its lower end upwards, also by `new`. When a run ends, all memory given out during the run is taken back.

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

extern "C" unsigned char __heap_base;

namespace {

uintptr_t top;

void *give(size_t size) {
	const uintptr_t at = ((top ? top : uintptr_t(&__heap_base)) + 15) & ~uintptr_t(15);
	top = at + size;
	const size_t page = 1 << 16, have = __builtin_wasm_memory_size(0) * page;
	if (top > have && __builtin_wasm_memory_grow(0, (top - have + page - 1) / page) == size_t(-1)) __builtin_trap();
	return reinterpret_cast<void *>(at);
}

Job job;
uint32_t status_words[(decltype(Model::p_status)::bits + 31) / 32];
const uint8_t never = 0;

} // namespace

void *operator new(size_t size) { return give(size); }
void *operator new[](size_t size) { return give(size); }
void operator delete(void *) noexcept {}
void operator delete(void *, size_t) noexcept {}
void operator delete[](void *) noexcept {}
void operator delete[](void *, size_t) noexcept {}
extern "C" void abort() { __builtin_trap(); }
extern "C" void __cxa_pure_virtual() { __builtin_trap(); }

// Memory for the arrays of a run. `release` takes all memory back.
EXPORT(reserve) void *reserve(uint32_t size) { return give(size); }
EXPORT(release) void release() { top = 0; }

// Results of a run: number of cycles up to and including the last transfer, number of pixels, and words of the status.
EXPORT(cycles) int32_t cycles() { return job.last + 1; }
EXPORT(given) int32_t given() { return job.given; }
EXPORT(status) const uint32_t *status() { return status_words; }

// Prepares the next run, which starts at power-up. The arrays are members of `Job`, in memory from `reserve`.
EXPORT(prepare) void prepare(const uint32_t *write, int32_t writes, const uint32_t *input, int32_t inputs, uint32_t *output,
		int32_t count, int64_t *cycles, int64_t *input_cycles) {
	job = Job{};
	job.write = write;
	job.write_count = writes;
	job.input = input;
	job.input_count = inputs;
	job.input_stalls = job.output_stalls = &never;
	job.input_period = job.output_period = 1;
	job.count = count;
	job.idle_timeout = 10000;
	job.settle = 64;
	job.last = -1;
	job.output = output;
	job.cycles = cycles;
	job.input_cycles = input_cycles;
	job.status = status_words;
}

// Runs to the end, and returns the `End`.
EXPORT(run) int32_t run() {
	const uintptr_t before = top;
	const int32_t end = blysk_run(blysk_open(), &job, int64_t(1) << 40);
	top = before;
	return end;
}

// Runs at most `limit` clocks, one after the other. After each clock a row of `rows` gets the status, as it is on the
// next clock. Returns the number of rows. `ended` gets the `End`.
EXPORT(trace) int32_t trace(uint32_t *rows, int32_t limit, int32_t *ended) {
	const uintptr_t before = top;
	Simulation *simulation = static_cast<Simulation *>(blysk_open());
	const size_t pixel_words = count(simulation->model.p_o____payload), words = sizeof status_words / sizeof *status_words;
	int32_t row = 0;
	while (row < limit) {
		const int64_t given = job.given;
		*ended = blysk_run(simulation, &job, 1);
		job.output += (job.given - given) * pixel_words;
		job.cycles += job.given - given;
		if (*ended != LIMIT) break;
		memcpy(rows + row++ * words, status_words, sizeof status_words);
	}
	top = before;
	return row;
}
