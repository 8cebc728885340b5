!> The rigid water of scene 7.
module frb_water_model
    use frb, only: wp, rigid_body, free_flow, splitting_plan, quat_product, quat_conjugate, quat_to_matrix
    implicit none
    private

    public :: cluster, load, run_water

    ! fpm does not see changes of included files: remove build/ after one.
    include '../../examples/water_model.inc'

end module frb_water_model
