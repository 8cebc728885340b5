!> Rivals by van Zon and Schofield, from the text that the chart program times.
!> fpm does not see changes of included files: remove build/ after one.
module frb_double_frames
    use frb_agm, only: ellip_f, ellip_k, jacobi
    use frb_kinds, only: rk => wp
    use frb_rotations, only: matrix_to_quat, quat_product
    implicit none
    private

    public :: frame_steps

contains

    include '../app/charts/rivals/frames.inc'

end module frb_double_frames
