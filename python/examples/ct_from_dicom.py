"""CT slices that pydicom reads, in Hounsfield units and in their place in the world."""

from pathlib import Path

import numpy as np
import pydicom
from make_dicom import make_dicom

import forward_resample as fr

folder = Path("dicom")
make_dicom(folder)  # stands for the folder of a scanner

slices = [pydicom.dcmread(path) for path in folder.glob("*.dcm")]
slices.sort(key=lambda slice: slice.ImagePositionPatient[2])
values = np.stack([slice.pixel_array * slice.RescaleSlope + slice.RescaleIntercept for slice in slices]).astype(np.int16)
row, column = slices[0].PixelSpacing
depth = slices[1].ImagePositionPatient[2] - slices[0].ImagePositionPatient[2]

head = fr.Volume(values, spacing=(column, row, depth), origin=slices[0].ImagePositionPatient)
picture = head.render(preset="ct-bone", up="z", orbit=(20, 10), shade="phong", size=(480, 480), background="black")
picture.save("ct_from_dicom.png")
