"""Makes a small CT of a phantom, for the examples: a skull of bone around soft tissue."""

from pathlib import Path

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid


def make_dicom(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    z, y, x = np.mgrid[-1:1:40j, -1:1:80j, -1:1:80j]
    radius = np.sqrt((x / 0.75) ** 2 + (y / 0.9) ** 2 + (z / 0.9) ** 2)
    units = np.where(radius < 1.0, 1200, -1000)
    units = np.where(radius < 0.88, 40, units)
    eyes = np.minimum(np.hypot(x - 0.28, z - 0.1), np.hypot(x + 0.28, z - 0.1))
    units = np.where((eyes < 0.17) & (y < -0.4), -1000, units)
    for number, plane in enumerate(units):
        data = Dataset()
        data.file_meta = FileMetaDataset()
        data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID = CTImageStorage
        data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID = generate_uid()
        data.Modality, data.Rows, data.Columns = "CT", *plane.shape
        data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
        data.BitsAllocated = data.BitsStored = 16
        data.HighBit, data.PixelRepresentation = 15, 0
        data.PixelSpacing, data.SliceThickness = [0.5, 0.5], 1.0
        data.ImagePositionPatient = [-20.0, -20.0, float(number)]
        data.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        data.RescaleSlope, data.RescaleIntercept = 1, -1024
        data.PixelData = (plane + 1024).astype(np.uint16).tobytes()
        data.save_as(folder / f"{number:03}.dcm", enforce_file_format=True)
