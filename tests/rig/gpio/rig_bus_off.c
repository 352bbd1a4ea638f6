// SPDX-License-Identifier: GPL-2.0-only OR Apache-2.0
// Takes a CAN interface off its bus as its driver does when the controller has counted too many errors: the emulated controllers count none. So
// the controller is also reset, like one that has counted too many, and neither receives nor sends. Nothing may be sent meanwhile: in reset the
// registers of a frame are those of the acceptance filter, and the controller would receive nothing when it is back. The kernel, the driver and
// the interface's restart-ms determine whether and when it comes back.
//
//   echo can0 >/sys/kernel/debug/rig_bus_off/told      sends an error frame to its receivers
//   echo can0 >/sys/kernel/debug/rig_bus_off/untold    the error frame got lost, and frames that are sent vanish without an error
#include <linux/can/dev.h>
#include <linux/debugfs.h>
#include <linux/io.h>
#include <linux/module.h>
#include <linux/netdevice.h>
#include <linux/pci.h>
#include <linux/string.h>
#include <linux/uaccess.h>

/* Of kvaser_pci: the BAR with the registers of the SJA1000. The first is its mode, with the reset in bit 0. */
#define RIG_REGISTERS_BAR 1
#define RIG_RESET 1

static struct dentry *folder;

static void take_off(struct net_device *device, bool is_told)
{
	struct can_frame *told;
	struct sk_buff *frame;

	local_bh_disable();
	/* The driver wakes the queue when it restarts the controller. */
	netif_tx_disable(device);
	outb(RIG_RESET, pci_resource_start(to_pci_dev(device->dev.parent), RIG_REGISTERS_BAR));
	frame = is_told ? alloc_can_err_skb(device, &told) : NULL;
	can_change_state(device, frame ? told : NULL, CAN_STATE_BUS_OFF, CAN_STATE_BUS_OFF);
	can_bus_off(device);
	if (frame)
		netif_rx(frame);
	local_bh_enable();
}

static ssize_t rig_write(struct file *from, const char __user *text, size_t length, loff_t *at)
{
	char name[IFNAMSIZ] = "";
	struct net_device *device;
	ssize_t result = length;

	if (length >= sizeof(name))
		return -EINVAL;
	if (copy_from_user(name, text, length))
		return -EFAULT;
	device = dev_get_by_name(&init_net, strim(name));
	if (!device)
		return -ENODEV;
	rtnl_lock();
	if (safe_candev_priv(device) && device->dev.parent && dev_is_pci(device->dev.parent) && netif_running(device) &&
	    netif_carrier_ok(device))
		take_off(device, !file_inode(from)->i_private);
	else
		result = -ENETDOWN;
	rtnl_unlock();
	dev_put(device);
	return result;
}

static const struct file_operations fops = {.owner = THIS_MODULE, .write = rig_write};

static int __init rig_bus_off_init(void)
{
	folder = debugfs_create_dir("rig_bus_off", NULL);
	debugfs_create_file_unsafe("told", 0200, folder, NULL, &fops);
	debugfs_create_file_unsafe("untold", 0200, folder, folder, &fops);
	return 0;
}

static void __exit rig_bus_off_exit(void)
{
	debugfs_remove_recursive(folder);
}

module_init(rig_bus_off_init);
module_exit(rig_bus_off_exit);
MODULE_DESCRIPTION("Takes a CAN interface off its bus, for tests");
MODULE_LICENSE("GPL");
