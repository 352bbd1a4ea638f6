// SPDX-License-Identifier: GPL-2.0-only OR Apache-2.0
// A GPIO chip without hardware, for the emulated machine: Debian's kernel has none that a test could use.
//
//   /sys/kernel/debug/rig_gpio/line0 ...   reading returns the level of the pin, writing sets it from outside
//   /sys/kernel/debug/rig_gpio/log         every level that a pin got, oldest first, "LINE LEVEL TIME" in each row: when it became an
//                                          output, and whenever it changed. TIME in us of CLOCK_MONOTONIC
//
// Levels are electrical ones. There is deliberately no free() in this driver: like on many a board, a line that is released keeps its level.
#include <linux/debugfs.h>
#include <linux/gpio/driver.h>
#include <linux/module.h>
#include <linux/platform_device.h>
#include <linux/seq_file.h>
#include <linux/version.h>

#define LINES 32
#define LOG_MAX 65536

static struct platform_device *device;
static struct dentry *folder;
static struct gpio_chip chip;
static bool level[LINES], is_output[LINES];
static u8 log_line[LOG_MAX], log_level[LOG_MAX];
static u64 log_time_us[LOG_MAX];
static unsigned int log_count;
static DEFINE_SPINLOCK(lock);

static void change(unsigned int line, int value, bool is_news)
{
	unsigned long flags;

	spin_lock_irqsave(&lock, flags);
	is_news |= level[line] != !!value;
	level[line] = !!value;
	if (is_news && log_count < LOG_MAX) {
		log_line[log_count] = line;
		log_time_us[log_count] = ktime_to_us(ktime_get());
		log_level[log_count++] = !!value;
	}
	spin_unlock_irqrestore(&lock, flags);
}

#if LINUX_VERSION_CODE >= KERNEL_VERSION(6, 17, 0)
static int rig_set(struct gpio_chip *gc, unsigned int line, int value)
{
	change(line, value, false);
	return 0;
}
#else
static void rig_set(struct gpio_chip *gc, unsigned int line, int value)
{
	change(line, value, false);
}
#endif

static int rig_get(struct gpio_chip *gc, unsigned int line)
{
	return level[line];
}

static int rig_direction_output(struct gpio_chip *gc, unsigned int line, int value)
{
	is_output[line] = true;
	change(line, value, true);
	return 0;
}

static int rig_direction_input(struct gpio_chip *gc, unsigned int line)
{
	is_output[line] = false;
	return 0;
}

static int rig_get_direction(struct gpio_chip *gc, unsigned int line)
{
	return is_output[line] ? GPIO_LINE_DIRECTION_OUT : GPIO_LINE_DIRECTION_IN;
}

static void rig_irq_mask(struct irq_data *data)
{
	gpiochip_disable_irq(&chip, irqd_to_hwirq(data));
}

static void rig_irq_unmask(struct irq_data *data)
{
	gpiochip_enable_irq(&chip, irqd_to_hwirq(data));
}

// Every change interrupts; only both edges can be requested.
static int rig_irq_set_type(struct irq_data *data, unsigned int type)
{
	return (type & IRQ_TYPE_EDGE_BOTH) == IRQ_TYPE_EDGE_BOTH ? 0 : -EINVAL;
}

static const struct irq_chip rig_irq_chip = {
	.name = "rig_gpio",
	.irq_mask = rig_irq_mask,
	.irq_unmask = rig_irq_unmask,
	.irq_set_type = rig_irq_set_type,
	.flags = IRQCHIP_IMMUTABLE,
	GPIOCHIP_IRQ_RESOURCE_HELPERS,
};

static int line_get(void *data, u64 *value)
{
	*value = level[(uintptr_t)data];
	return 0;
}

static int line_set(void *data, u64 value)
{
	unsigned int line = (uintptr_t)data;

	if (is_output[line])
		return -EPERM;
	if (level[line] == !!value)
		return 0;
	change(line, value, false);
	return gpiochip_line_is_irq(&chip, line) ? generic_handle_domain_irq_safe(chip.irq.domain, line) : 0;
}
DEFINE_DEBUGFS_ATTRIBUTE(line_fops, line_get, line_set, "%llu\n");

static int log_show(struct seq_file *file, void *unused)
{
	unsigned int i;

	for (i = 0; i < log_count; ++i)
		seq_printf(file, "%u %u %llu\n", log_line[i], log_level[i], log_time_us[i]);
	return 0;
}
DEFINE_SHOW_ATTRIBUTE(log);

static int rig_probe(struct platform_device *pdev)
{
	chip = (struct gpio_chip){
		.label = "rig_gpio",
		.parent = &pdev->dev,
		.owner = THIS_MODULE,
		.base = -1,
		.ngpio = LINES,
		.get_direction = rig_get_direction,
		.direction_input = rig_direction_input,
		.direction_output = rig_direction_output,
		.get = rig_get,
		.set = rig_set,
		.irq.handler = handle_simple_irq,
		.irq.default_type = IRQ_TYPE_NONE,
	};
	gpio_irq_chip_set_chip(&chip.irq, &rig_irq_chip);
	return devm_gpiochip_add_data(&pdev->dev, &chip, NULL);
}

// Unbound from its device, the chip vanishes as a USB adapter does.
static struct platform_driver driver = {.probe = rig_probe, .driver.name = "rig_gpio"};

static int __init rig_gpio_init(void)
{
	char name[8];
	uintptr_t line;
	int error = platform_driver_register(&driver);

	if (error)
		return error;
	device = platform_device_register_simple("rig_gpio", PLATFORM_DEVID_NONE, NULL, 0);
	if (IS_ERR(device)) {
		platform_driver_unregister(&driver);
		return PTR_ERR(device);
	}
	folder = debugfs_create_dir("rig_gpio", NULL);
	debugfs_create_file("log", 0400, folder, NULL, &log_fops);
	for (line = 0; line < LINES; ++line) {
		snprintf(name, sizeof(name), "line%u", (unsigned int)line);
		debugfs_create_file_unsafe(name, 0600, folder, (void *)line, &line_fops);
	}
	return 0;
}

static void __exit rig_gpio_exit(void)
{
	debugfs_remove_recursive(folder);
	platform_device_unregister(device);
	platform_driver_unregister(&driver);
}

module_init(rig_gpio_init);
module_exit(rig_gpio_exit);
MODULE_DESCRIPTION("GPIO chip without hardware, for tests");
MODULE_LICENSE("GPL");
